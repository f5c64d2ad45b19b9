"""What the arm asks of its servos, whoever made them."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from hardware.transport.port import NoAnswer, Wire
from hardware.transport.request import Framer, drain
from oio.core.records import Array

Positions = NDArray[np.int64]
P = TypeVar("P")
TRIES = 3
ANSWER_S = 0.03  # host seconds for all servos: 0.7 ms of wire time, return delays, and a busy host


@dataclass(frozen=True, slots=True)
class ServoState:
    """One look at all servos: counts (n,), load (n,) as a fraction of the most, and what one of them complains of, if it does."""

    counts: Positions
    load: Array
    complaint: str | None


@dataclass(frozen=True, slots=True)
class ServoHealth:
    """One servo: whether it holds, the goal it was given last [counts], its supply and its case."""

    holds: bool
    goal: int
    voltage: float
    temperature_degc: float


class Bus(Protocol):
    """Servos at one wire. Everything raises Unplugged or NoAnswer."""

    name: str  # as typed after backend.arm.driver=
    baud: int
    counts_per_turn: int
    middle: int  # counts of a joint's zero where nothing was homed

    def ping(self, wire: Wire, servo: int) -> str | None:
        """Its model, or None."""
        ...

    def begin(self, wire: Wire, ids: Sequence[int]) -> None:
        """Position mode, answers without delay."""
        ...

    def feel(self, wire: Wire, ids: Sequence[int]) -> ServoState:
        """Where all are, and what they carry."""
        ...

    def goals(self, wire: Wire, ids: Sequence[int], counts: Positions) -> None:
        """Where all shall go; nobody answers."""
        ...

    def torque(self, wire: Wire, ids: Sequence[int], on: bool) -> None:
        """Hold, or let go. Raises NoAnswer for a servo that refuses to hold."""
        ...

    def health(self, wire: Wire, servo: int) -> ServoHealth:
        """How one of them is."""
        ...

    def framer(self) -> Framer[Any]:
        """Whose counts are those of the wire."""
        ...


def ask_one(wire: Wire, question: bytes, framer: Framer[P], servo: int, of: Callable[[P], int | None]) -> P:
    """The packet of one servo, for questions that may be asked again. Raises NoAnswer."""
    for _ in range(TRIES - 1):
        try:
            return ask_all(wire, question, framer, [servo], of)[0]
        except NoAnswer:
            time.sleep(ANSWER_S)  # one that is only late shall be gone before the next question
    return ask_all(wire, question, framer, [servo], of)[0]


def ask_all(wire: Wire, question: bytes, framer: Framer[P], ids: Sequence[int], of: Callable[[P], int | None]) -> list[P]:
    """One packet of each servo, in the order of `ids`; `of` says whose answer a packet is. Raises NoAnswer if one is missing."""
    drain(wire, framer)
    wire.write(question)
    until_s, heard = time.monotonic() + ANSWER_S, dict[int, P]()
    while len(heard) < len(ids) and (left_s := until_s - time.monotonic()) > 0:
        _sort(framer.feed(wire.read(left_s)), ids, of, heard)
    if len(heard) < len(ids):
        _sort(framer.quiet(), ids, of, heard)
    missing = [servo for servo in ids if servo not in heard]
    if missing:
        raise NoAnswer(f"servo {missing[0]} does not answer")
    return [heard[servo] for servo in ids]


def _sort(packets: Sequence[P], ids: Sequence[int], of: Callable[[P], int | None], heard: dict[int, P]) -> None:
    for packet in packets:
        servo = of(packet)
        if servo is not None and servo in ids:
            heard[servo] = packet
