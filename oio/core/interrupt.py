"""Graceful interrupts: Ctrl-C and SIGTERM take effect between two samples, never within a write to the log; the second at once.

For commands that call `check` while they work. Every other command keeps what `oio.core.startup.handle_signals` installed: its first signal
ends it.
"""

import contextlib
import signal
from collections.abc import Iterator

_asked: list[int] = []


def listen() -> None:
    """Install the handlers of both signals."""
    signal.signal(signal.SIGINT, _ask)
    signal.signal(signal.SIGTERM, _ask)


@contextlib.contextmanager
def listening() -> Iterator[None]:
    """Install the handlers of both signals for a block that calls `check`; those from before it are installed again after it."""
    before = [(number, signal.getsignal(number)) for number in (signal.SIGINT, signal.SIGTERM)]
    listen()
    try:
        yield
    finally:
        for number, handler in before:
            signal.signal(number, handler)


def note_only() -> None:
    """Install handlers that never raise, for workers: an exception within compiled code would be taken for a defect of it."""
    signal.signal(signal.SIGTERM, lambda number, frame: _asked.append(number))
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group of processes; the parent decides


def asked() -> bool:
    """Whether a signal has come."""
    return bool(_asked)


def check() -> None:
    """Raise KeyboardInterrupt if a signal has come."""
    if _asked:
        raise KeyboardInterrupt


def _ask(number: int, frame: object) -> None:
    if _asked:
        raise KeyboardInterrupt
    _asked.append(number)
