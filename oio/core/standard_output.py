"""Standard output at the end of a command: all of it written, or nobody there to read it."""

import errno
import os
import select
import sys
from collections.abc import Callable
from typing import TextIO

NOBODY_READS = 141  # 128 + SIGPIPE, as shells say


def ended(main: Callable[[], int]) -> int:
    """Run a command to its end, all that it printed written out; returns its exit code.

    Where nobody reads its output any more (`| head -1`) it ends without a word, and where the output cannot be written with a line. What
    a command prints is lost where its caller closed standard output or error.
    """
    sys.stdout, sys.stderr = sys.stdout or _nowhere(), sys.stderr or _nowhere()
    try:
        try:
            code = main()
        except SystemExit:  # argparse, after its help
            sys.stdout.flush()
            raise
        sys.stdout.flush()
        return code
    except OSError as error:
        unread = isinstance(error, BrokenPipeError) and _nobody_reads()
        if not unread and (error.errno != errno.ENOSPC or error.filename is not None):
            raise
        sys.stdout = _nowhere()  # the interpreter writes out the rest as it ends
        if unread:
            return NOBODY_READS
        os.write(2, f"oio: standard output cannot be written: {os.strerror(errno.ENOSPC).lower()}.\n".encode())
        return 1


def _nowhere() -> TextIO:
    return open(os.devnull, "w", encoding="utf-8")


def _nobody_reads() -> bool:
    """Whether standard output is a pipe whose other end is closed."""
    poll = select.poll()
    poll.register(sys.stdout.fileno(), select.POLLOUT)
    return any(state & (select.POLLERR | select.POLLHUP) for _, state in poll.poll(0))
