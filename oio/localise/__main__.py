"""`python -m oio.localise LOG`: known errors print one paragraph; exit code 2 for bad input, 3 for a verdict FAIL, else 1."""

import sys

from oio.core import startup
from oio.core.standard_output import ended

startup.handle_signals(__name__)

from oio.localise.command import main

if __name__ == "__main__":
    sys.exit(ended(main))
