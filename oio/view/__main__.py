"""`python -m oio.view LOG [--save OUT.rrd | --address URL]`: a run in the Rerun viewer, from its log."""

import sys
from pathlib import Path

from oio.core import startup
from oio.core.standard_output import ended

startup.handle_signals(__name__)

from oio.core.arguments import CommandParser
from oio.core.errors import BadInput
from oio.log import read_entries, read_metadata
from oio.log.wall_clock import start_ns
from oio.view.rerun_view import RerunView

CODES = "exit code: 0 shown or saved, 2 bad input"


def main(arguments: list[str] | None = None) -> int:
    """Show one log; returns the exit code."""
    parser = CommandParser(example="outputs/first", prog="python -m oio.view", description=__doc__, epilog=CODES)
    parser.add_argument("log", type=Path, metavar="LOG", help="the log of a run, e.g. outputs/first/run.mcap, or the folder that holds it")
    parser.add_argument("--save", metavar="OUT.rrd", help="write a file that the viewer reads, instead of opening a window")
    parser.add_argument("--address", metavar="URL", help="of a viewer that runs, e.g. rerun+http://127.0.0.1:9876/proxy")
    given = parser.parse_args(arguments)
    try:
        shown = show(given.log / "run.mcap" if given.log.is_dir() else given.log, RerunView(address=given.address, file=given.save))
    except BadInput as error:
        sys.stderr.write(f"{error}\n")
        return error.exit_code
    sys.stdout.write(f"{given.save or 'shown'}: {shown} entries\n")
    return 0


def show(log: Path, view: RerunView) -> int:
    """Tell a view all that is in a log; returns how many entries that were. Raises BadInput for no log, and as `RerunView.open` does."""
    entries, told = read_entries(log), 0
    with view.open() as watcher:
        watcher.describe(log.parent.name if log.name == "run.mcap" else log.stem, start_ns(read_metadata(log)))
        for entry in entries:
            watcher(entry)
            told += 1
    return told


if __name__ == "__main__":
    sys.exit(ended(main))
