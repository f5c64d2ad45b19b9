"""`python -m oio.report RUN_OR_SWEEP`: one HTML file that says whether to trust a calibration, why, and what to do next."""

import sys
from pathlib import Path

from oio.core import startup
from oio.core.standard_output import ended

startup.handle_signals(__name__)

from oio.cli.exit_codes import run_command
from oio.core.arguments import CommandParser
from oio.report.write import write_report


def main(arguments: list[str] | None = None) -> int:
    """Write a report and print its path; returns the exit code."""
    parser = CommandParser(
        example="outputs/first", prog="python -m oio.report", description=__doc__, epilog="exit code: 0 written, 2 bad input"
    )
    parser.add_argument(
        "folder", type=Path, metavar="RUN_OR_SWEEP", help="the folder of a run with run.mcap, or of a sweep with sweep.json"
    )
    parser.add_argument("--out", type=Path, metavar="FILE.html", help="the report (default: report.html in that folder)")
    parser.add_argument("--figures", type=Path, metavar="FOLDER", help="also write every figure as SVG and PNG to this folder")
    given = parser.parse_args(arguments)

    def run() -> None:
        sys.stdout.write(f"{write_report(given.folder, given.out, given.figures)}\n")

    return run_command(run)


if __name__ == "__main__":
    sys.exit(ended(main))
