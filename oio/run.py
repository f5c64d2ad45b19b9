"""The command `python -m oio.run`; what it does is in `oio.cli.run`."""

import sys

from oio.cli import startup

startup.handle_signals(__name__)

from oio.cli.run import main

if __name__ == "__main__":
    sys.exit(main())
