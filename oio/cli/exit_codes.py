"""How every command ends: a known error in one paragraph with its exit code, a stop in one line, a bug with its trace."""

import os
import sys
from collections.abc import Callable

from oio.cli.hydra_errors import known_error
from oio.core.folders import CONF

STOPPED = 130  # 128 + SIGINT, as shells say


def run_command(run: Callable[[], None], stopped: str = "stopped.") -> int:
    """The exit code of `run`; `stopped` is said when it was asked to stop. OIO_FULL_ERROR=1 shows the trace of known errors, too."""
    try:
        run()
    except KeyboardInterrupt:
        sys.stderr.write(f"oio: {stopped}\n")
        return STOPPED
    except Exception as error:
        known = known_error(error, CONF)
        if known is None or os.environ.get("OIO_FULL_ERROR") == "1":
            raise
        sys.stderr.write(f"oio: {known}\n")
        return known.exit_code
    return 0
