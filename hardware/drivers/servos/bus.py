"""Servo bus protocol: what the arm driver requires of servos of any maker."""

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
ANSWER_S = 0.03  # time-out for all servos [host s]: 0.7 ms of wire time, return delays, and a busy host


@dataclass(frozen=True, slots=True)
class ServoState:
    """State of all servos at one time: positions (n,) [counts], load (n,) as a fraction of full load, fault text of one of them or None."""

    counts: Positions
    load: Array
    fault: str | None


@dataclass(frozen=True, slots=True)
class ServoHealth:
    """Health of one servo: torque enabled, goal position [counts], supply voltage [V], temperature."""

    holds: bool
    goal: int
    voltage: float
    temperature_degc: float


class Bus(Protocol):
    """Protocol of the servos on one wire. Every method raises Unplugged or NoAnswer."""

    name: str  # value of backend.arm.driver=
    baud: int
    counts_per_turn: int
    middle: int  # counts of a joint's zero without homing

    def ping(self, wire: Wire, servo: int) -> str | None:
        """Return the servo's model; None on a time-out."""
        ...

    def configure(self, wire: Wire, ids: Sequence[int]) -> None:
        """Set position mode and zero return delay."""
        ...

    def read_state(self, wire: Wire, ids: Sequence[int]) -> ServoState:
        """Read position and load of all servos."""
        ...

    def write_goals(self, wire: Wire, ids: Sequence[int], counts: Positions) -> None:
        """Write the goal positions [counts] of all servos; the servos send no status."""
        ...

    def torque(self, wire: Wire, ids: Sequence[int], on: bool) -> None:
        """Enable or disable torque. Raises NoAnswer for a servo that refuses to enable it."""
        ...

    def health(self, wire: Wire, servo: int) -> ServoHealth:
        """Read the health of one servo."""
        ...

    def framer(self) -> Framer[Any]:
        """Return the frame decoder, whose counters are the statistics of the wire."""
        ...


def ask_one(wire: Wire, question: bytes, framer: Framer[P], servo: int, of: Callable[[P], int | None]) -> P:
    """Return the reply of one servo, with retries, for idempotent requests. Raises NoAnswer."""
    for _ in range(TRIES - 1):
        try:
            return ask_all(wire, question, framer, [servo], of)[0]
        except NoAnswer:
            time.sleep(ANSWER_S)  # a late reply must have arrived before the next request
    return ask_all(wire, question, framer, [servo], of)[0]


def ask_all(wire: Wire, question: bytes, framer: Framer[P], ids: Sequence[int], of: Callable[[P], int | None]) -> list[P]:
    """Return one reply per servo, in the order of `ids`; `of` maps a packet to its servo id or None. Raises NoAnswer if one is missing."""
    drain(wire, framer)
    wire.write(question)
    until_s, replies = time.monotonic() + ANSWER_S, dict[int, P]()
    while len(replies) < len(ids) and (left_s := until_s - time.monotonic()) > 0:
        _sort(framer.feed(wire.read(left_s)), ids, of, replies)
    if len(replies) < len(ids):
        _sort(framer.flush(), ids, of, replies)
    missing = [servo for servo in ids if servo not in replies]
    if missing:
        raise NoAnswer(f"servo {missing[0]} does not answer")
    return [replies[servo] for servo in ids]


def _sort(packets: Sequence[P], ids: Sequence[int], of: Callable[[P], int | None], replies: dict[int, P]) -> None:
    for packet in packets:
        servo = of(packet)
        if servo is not None and servo in ids:
            replies[servo] = packet
