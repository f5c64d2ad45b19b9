"""`python -m oio.compare A B`: what changed between calibrations, in standard deviations; of more than two, what is not constant."""

import sys
from pathlib import Path

from oio.core import startup
from oio.core.standard_output import ended

startup.handle_signals(__name__)

from oio.compare.comparison import compare
from oio.compare.display import show
from oio.compare.files import refuse_unwritable, save
from oio.core.arguments import CommandParser
from oio.core.errors import BadInput
from oio.results.calibration_entries import read_calibration

AGREE, DIFFER = 0, 3  # 2, bad input, is BadInput.exit_code and argparse's own
_CODES = "exit code: 0 they agree within their uncertainty, 3 they differ, 2 bad input"


def main(arguments: list[str] | None = None) -> int:
    """Compare calibrations and print table and verdict; returns the exit code."""
    given = _parser().parse_args(arguments)
    try:
        if len(given.calibration) < 2:
            raise BadInput(f"{given.calibration[0]} was given, but two or more are compared. Type python -m oio.compare MONDAY FRIDAY")
        if given.out:
            refuse_unwritable(given.out)
        found = compare([read_calibration(path) for path in given.calibration], tuple(given.judge.split(",")))
        if given.out:
            save(found, given.out)
    except BadInput as error:
        sys.stderr.write(f"{error}\n")
        return error.exit_code
    show(found, given.sort == "section")
    return AGREE if found.agree else DIFFER


def _parser() -> CommandParser:
    parser = CommandParser(example="outputs/monday outputs/friday", prog="python -m oio.compare", description=__doc__, epilog=_CODES)
    parser.add_argument(
        "calibration",
        type=Path,
        nargs="+",
        metavar="CALIBRATION",
        help="a calibration.yaml, a run's folder or its run.mcap; in order of time",
    )
    parser.add_argument("--sort", choices=("size", "section"), default="size", help="largest difference first (default), or as in the file")
    parser.add_argument(
        "--judge", default="sensor,arm", metavar="SECTION,...",
        help="sections that decide (default sensor,arm); range_law is the air of its hour, and its uncertainty leaves other hours out",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, metavar="FILE", help="also a file: .csv, .json or .md")
    return parser


if __name__ == "__main__":
    sys.exit(ended(main))
