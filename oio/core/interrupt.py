"""A stop asked for by Ctrl-C or SIGTERM happens between two samples, never within a write to the log; asked twice, it happens at once."""

import signal

_asked: list[int] = []


def listen() -> None:
    """From now on both signals ask."""
    signal.signal(signal.SIGINT, _ask)
    signal.signal(signal.SIGTERM, _ask)


def check() -> None:
    """Raise KeyboardInterrupt if a stop was asked for."""
    if _asked:
        raise KeyboardInterrupt


def _ask(number: int, frame: object) -> None:
    if _asked:
        raise KeyboardInterrupt
    _asked.append(number)
