"""The command `python -m oio.run`; what it does is in `oio.cli.run`."""

import sys

from oio.cli import startup
from oio.cli.help import asks_for_help, show_help_for

startup.handle_signals(__name__)


def main() -> int:
    """Run the command; returns the exit code. Help comes without what takes a second to load."""
    if asks_for_help(sys.argv[1:]):
        show_help_for(sys.argv[1:])
        return 0
    from oio.cli.run import main as run

    return run()


if __name__ == "__main__":
    sys.exit(main())
