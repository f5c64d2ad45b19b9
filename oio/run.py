"""The command `python -m oio.run`; what it does is in `oio.cli.run`."""

import sys

from oio import __version__
from oio.cli.help import asks_for_help, show_help_for
from oio.core import startup
from oio.core.errors import BadInput
from oio.core.standard_output import ended

startup.handle_signals(__name__)


def main() -> int:
    """Run the command; returns the exit code."""
    return ended(_run)


def _run() -> int:
    """Help and version come without what takes a second to load."""
    if "--version" in sys.argv[1:]:
        sys.stdout.write(f"oio {__version__}\n")
        return 0
    if asks_for_help(sys.argv[1:]):
        return _help(sys.argv[1:])
    from oio.cli.run import main as run_configured

    code = run_configured()
    return _report() or code


def _help(arguments: list[str]) -> int:
    try:
        show_help_for(arguments)
    except BadInput as error:
        sys.stderr.write(f"oio: {error}\n")
        return error.exit_code
    return 0


def _report() -> int:
    """Write the report of a run that is done; its libraries are loaded only now."""
    from oio.cli.exit_codes import run_command
    from oio.cli.outcome import TO_REPORT

    if not TO_REPORT:
        return 0
    from oio.report.write import write_report

    folder = TO_REPORT.pop()

    def write() -> None:
        sys.stdout.write(f"report: {write_report(folder)}\n")

    return run_command(write, "stopped before the report was written; the run itself is done.")


if __name__ == "__main__":
    sys.exit(main())
