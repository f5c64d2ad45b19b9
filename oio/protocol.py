"""The command `python -m oio.protocol`; what it does is in `oio.cli.protocol_page`."""

import sys

from oio.cli.protocol_page import main
from oio.core.standard_output import ended

if __name__ == "__main__":
    sys.exit(ended(main))
