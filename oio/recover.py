"""The command `python -m oio.recover`; what it does is in `oio.cli.recover`."""

import sys

from oio.cli.recover import main
from oio.core.standard_output import ended

if __name__ == "__main__":
    sys.exit(ended(main))
