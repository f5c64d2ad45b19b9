"""`python -m oio.recover PATH [OUT]`: make a finished log of one whose run was killed."""

import sys
from pathlib import Path

from oio.core.arguments import CommandParser
from oio.core.errors import BadInput
from oio.core.records import seconds
from oio.log import salvage

COMPLETE, NOTHING, LOSSY = 0, 1, 3  # 2, bad input, is BadInput.exit_code and argparse's own


def main(arguments: list[str] | None = None) -> int:
    """Recover one log and say in one line what was kept; returns the exit code."""
    parser = CommandParser(example="outputs/first/run.mcap.part", prog="python -m oio.recover", description=__doc__, epilog=_CODES)
    parser.add_argument("path", type=Path, metavar="PATH", help="the log, e.g. run.mcap.part; it is only read")
    parser.add_argument("out", type=Path, metavar="OUT", nargs="?", help="the finished log (default: PATH without .part)")
    given = parser.parse_args(arguments)
    try:
        code, line = _recover(given.path, given.out or _beside(given.path))
    except BadInput as error:
        sys.stderr.write(f"{error}\n")
        return error.exit_code
    sys.stdout.write(f"{line}\n")
    return code


_CODES = "exit code: 0 everything was kept, 3 the end or some damaged chunks are lost, 1 nothing could be kept, 2 bad input"


def _recover(path: Path, out: Path) -> tuple[int, str]:
    found = salvage(path, out)
    if found.messages == 0:
        return NOTHING, f"{path}: nothing could be kept, no message in it is complete."
    what = f"{out}: {found.messages} messages kept, until {seconds(found.until_ns):.3f} s"
    if found.complete:
        return COMPLETE, f"{what}; nothing is missing."
    return LOSSY, f"{what}; the end or some damaged chunks are missing."


def _beside(path: Path) -> Path:
    if path.suffix == ".part":
        return path.with_suffix("")
    return path.with_name(f"{path.stem}.recovered{path.suffix}")
