"""A question and its answer over a wire."""

import time
from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

from hardware.transport.port import NoAnswer, Wire

F = TypeVar("F")
F_co = TypeVar("F_co", covariant=True)


class Framer(Protocol[F_co]):
    """Cuts frames from bytes and counts them; those of `hardware.codecs` do."""

    good: int
    corrupt: int
    skipped: int

    def feed(self, data: bytes) -> Sequence[F_co]:
        """Whole frames that passed their check."""
        ...

    def quiet(self) -> Sequence[F_co]:
        """The line has fallen silent: frames that waited behind what looked like the head of a longer one."""
        ...


def drain(wire: Wire, framer: Framer[F]) -> list[F]:
    """Frames that came in unasked or late: nobody shall take them for the next answer."""
    frames: list[F] = []
    while data := wire.read(0.0):
        frames += framer.feed(data)
    return frames


def request(wire: Wire, question: bytes, framer: Framer[F], fits: Callable[[F], bool], within_s: float) -> F:
    """The first frame that fits, within so many seconds of the host. Raises NoAnswer."""
    drain(wire, framer)
    return _request(wire, question, framer, fits, within_s)


def _request(wire: Wire, question: bytes, framer: Framer[F], fits: Callable[[F], bool], within_s: float) -> F:
    wire.write(question)
    until_s = time.monotonic() + within_s
    while (left_s := until_s - time.monotonic()) > 0:
        for frame in framer.feed(wire.read(left_s)):
            if fits(frame):
                return frame
    for frame in framer.quiet():
        if fits(frame):
            return frame
    raise NoAnswer("no answer")


def request_until(wire: Wire, question: bytes, framer: Framer[F], fits: Callable[[F], bool], each_s: float, within_s: float) -> F:
    """The same, asked again every `each_s` for so long: noise was in the way, or the device boots. An answer that is late will do.

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
