"""`python -m oio.identify RUN` or `recording=NAME`: known errors print one paragraph; exit code 2 for bad input, else 1."""

import sys

from oio.core import startup
from oio.core.standard_output import ended

startup.handle_signals(__name__)

from oio.identify.command import main

if __name__ == "__main__":
    sys.exit(ended(main))
