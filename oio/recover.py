"""The command `python -m oio.recover`; what it does is in `oio.cli.recover`."""

import sys

from oio.core import startup
from oio.core.standard_output import ended

startup.handle_signals(__name__)

from oio.cli.recover import main

if __name__ == "__main__":
    sys.exit(ended(main))
