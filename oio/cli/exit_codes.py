"""Exit codes: 0 done, 1 a known failure, 2 bad input (`oio.core.errors` says which is which), 3 a verdict FAIL, 130 stopped; a bug
shows its traceback."""

import os
import sys
from collections.abc import Callable

from oio.cli.hydra_errors import known_error
from oio.core.folders import CONF

VERDICT_FAILED = 3  # the run is done, and says that its calibration or its answer is not to be trusted
STOPPED = 130  # 128 + SIGINT, as shells say


def run_command(run: Callable[[], None], stopped: str = "stopped.") -> int:
    """Run a command and return its exit code; `stopped` is printed on an interrupt. OIO_FULL_ERROR=1 shows tracebacks of known errors."""
    try:
        run()
    except KeyboardInterrupt as stop:
        sys.stderr.write(f"oio: {str(stop) or stopped}\n")
        return STOPPED
    except Exception as error:
        known = known_error(error, CONF)
        if known is None or os.environ.get("OIO_FULL_ERROR") == "1":
            raise
        sys.stderr.write(f"oio: {known}\n")
        return known.exit_code
    return 0
