"""Graceful interrupts: Ctrl-C and SIGTERM take effect between two samples, never within a write to the log; the second at once."""

import signal

_asked: list[int] = []


def listen() -> None:
    """Install the handlers of both signals."""
    signal.signal(signal.SIGINT, _ask)
    signal.signal(signal.SIGTERM, _ask)


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
