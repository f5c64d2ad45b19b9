"""`python -m oio.figures RUN_DIR [--out FILE.png]`: one picture of a run: the search from above, and its errors and readings over time."""

import sys
from pathlib import Path

from oio.core import startup
from oio.core.standard_output import ended

startup.handle_signals(__name__)

from oio.core.arguments import CommandParser
from oio.core.errors import BadInput
from oio.figures.picture import draw


def main(arguments: list[str] | None = None) -> int:
    """Draw one run and print the path of the figure; returns the exit code."""
    parser = CommandParser(
        example="outputs/first", prog="python -m oio.figures", description=__doc__, epilog="exit code: 0 drawn, 2 bad input"
    )
    parser.add_argument("run", type=Path, metavar="RUN_DIR", help="the folder of a run, with run.mcap and perhaps summary.json")
    parser.add_argument("--out", type=Path, metavar="FILE.png", help="the picture (default: RUN_DIR/search.png)")
    given = parser.parse_args(arguments)
    out = given.out or given.run / "search.png"
    try:
        draw(given.run, out)
    except BadInput as error:
        sys.stderr.write(f"{error}\n")
        return error.exit_code
    sys.stdout.write(f"{out}\n")
    return 0


if __name__ == "__main__":
    sys.exit(ended(main))
