"""The command `python -m oio.recover`; what it does is in `oio.cli.recover`."""

import sys

from oio.cli.recover import main

if __name__ == "__main__":
    sys.exit(main())
