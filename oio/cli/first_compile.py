"""The first run after an install: all that is compiled is compiled at once, in several processes, before the world opens.

Functions that are missing here compile when they are first called, as everywhere; for a live bench that would be in the middle of a search.
"""

import fcntl
import subprocess
import sys
import time
from contextlib import nullcontext, suppress

from oio.cli import terminal
from oio.core import interrupt
from oio.core.compiled import NUMBA, complete_mark
from oio.core.folders import ROOT
from oio.core.shipped_code import use_shipped

NAMES = ("map", "filter", "world")  # of the pieces, longest first
LOOK_S = 0.05
SAYS = "compiling for this computer, once after an install: less than a minute"


def first_compile(quiet: bool = False) -> None:
    """Fill the cache of compiled functions, unless that was done with these sources on this kind of processor, or the wheel brought them.

    Of several processes one does it, the others wait. What fails here is compiled, or fails, where it is used. A stop ends it.
    """
    done = complete_mark()
    if NUMBA.DISABLE_JIT or done.exists() or use_shipped():
        return
    told = nullcontext() if quiet else terminal.console(stderr=True).status(SAYS)
    with suppress(OSError), done.with_name("compiling").open("w") as lock, told:  # a cache that cannot be written is none
        _locked(lock.fileno())
        if not done.exists():
            _compile()
            done.touch()


def _locked(file: int) -> None:
    while True:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except BlockingIOError:
            interrupt.check()
            time.sleep(LOOK_S)


def _compile() -> None:
    command, silent = [sys.executable, "-m", "oio.cli.compile_pieces"], subprocess.DEVNULL
    pieces = [subprocess.Popen([*command, name], cwd=ROOT, stdin=silent, stdout=silent, stderr=silent) for name in NAMES]
    try:
        while any(piece.poll() is None for piece in pieces):
            interrupt.check()
            time.sleep(LOOK_S)
    finally:
        for piece in pieces:
            piece.kill()
            piece.wait()
