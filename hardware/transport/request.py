"""Request and reply over a wire, with time-outs and retries."""

import time
from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

from hardware.transport.port import NoAnswer, Wire

F = TypeVar("F")
F_co = TypeVar("F_co", covariant=True)


class Framer(Protocol[F_co]):
    """Protocol of a frame decoder: cuts frames from a byte stream and counts them, as those of `hardware.codecs` do."""

    good: int
    corrupt: int
    skipped: int

    def feed(self, data: bytes) -> Sequence[F_co]:
        """Return the complete frames that passed their checksum."""
        ...

    def flush(self) -> Sequence[F_co]:
        """Flush after the line has fallen silent: return frames held back behind a false head of a longer one."""
        ...


def drain(wire: Wire, framer: Framer[F]) -> list[F]:
    """Empty the input buffer and return its frames: unsolicited or late ones must not be taken for the next reply."""
    frames: list[F] = []
    while data := wire.read(0.0):
        frames += framer.feed(data)
    return frames


def request(wire: Wire, question: bytes, framer: Framer[F], fits: Callable[[F], bool], within_s: float) -> F:
    """Send a request and return the first frame that fits, within within_s host seconds. Raises NoAnswer."""
    drain(wire, framer)
    return _request(wire, question, framer, fits, within_s)


def _request(wire: Wire, question: bytes, framer: Framer[F], fits: Callable[[F], bool], within_s: float) -> F:
    wire.write(question)
    until_s = time.monotonic() + within_s
    while (left_s := until_s - time.monotonic()) > 0:
        for frame in framer.feed(wire.read(left_s)):
            if fits(frame):
                return frame
    for frame in framer.flush():
        if fits(frame):
            return frame
    raise NoAnswer("no answer")


def request_until(wire: Wire, question: bytes, framer: Framer[F], fits: Callable[[F], bool], each_s: float, within_s: float) -> F:
    """Send a request, repeated every `each_s` for within_s, against noise or a booting device; a late reply is accepted.

    Raises NoAnswer.
    """
    until_s = time.monotonic() + within_s
    drain(wire, framer)
    while True:
        try:
            return _request(wire, question, framer, fits, each_s)
        except NoAnswer:
            if time.monotonic() >= until_s:
                raise
