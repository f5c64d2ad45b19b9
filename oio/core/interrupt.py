"""Graceful interrupts: Ctrl-C and SIGTERM take effect between two samples, never within a write to the log; the second at once."""

import signal

_asked: list[int] = []


def listen() -> None:
    """Install the handlers of both signals."""
    signal.signal(signal.SIGINT, _ask)
    signal.signal(signal.SIGTERM, _ask)


def check() -> None:
    """Raise KeyboardInterrupt if a signal has come."""
    if _asked:
        raise KeyboardInterrupt


def _ask(number: int, frame: object) -> None:
    if _asked:
        raise KeyboardInterrupt
    _asked.append(number)
