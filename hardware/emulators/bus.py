"""Servos on one wire, whoever made them: who is asked, who answers after whom, and how long that takes."""

from collections.abc import Iterable, Mapping
from typing import Protocol

from hardware.emulators.device import Trouble

TICK_S = 2e-6  # of a return delay register, with either maker


class Servo(Protocol):
    """One of them, by its maker's registers."""

    @property
    def delay_s(self) -> float:
        """Before it answers."""
        ...

    def tick(self, t_s: float) -> None:
        """Until t_s."""
        ...

    def powered(self) -> None:
        """Its supply failed and is back: it holds nothing."""
        ...

    def obey(self, instruction: int, params: bytes) -> bytes:
        """Its status packet, or nothing."""
        ...

    def told(self, address: int, length: int) -> bytes:
        """The status packet of a read."""
        ...

    def write(self, address: int, data: bytes) -> int:
        """The error, or 0."""
        ...


class Bus:
    """All of them; a maker's class gives `_answer`."""

    baud, boots_when_opened = 1_000_000, False

    def __init__(self, servos: Mapping[int, Servo], trouble: Trouble) -> None:
        self.pause_s, self._servos, self._trouble = 0.0, servos, trouble

    def powered(self, t_s: float) -> None:
        """The plug is the adapter's; servos have a supply of their own."""

    def spoken(self, t_s: float) -> bytes:
        """They never speak unasked."""
        for servo in self._servos.values():
            if "brownout" in self._trouble:
                servo.powered()
            servo.tick(t_s)
        return b""

    def answer(self, data: bytes) -> bytes:
        """Status packets, one after the other."""
        self.pause_s = 0.0
        return b"" if "brownout" in self._trouble else self._answer(data)

    def _answer(self, data: bytes) -> bytes:
        raise NotImplementedError

    def _one(self, id: int, instruction: int, params: bytes) -> bytes:
        servo = self._servos.get(id)
        return b"" if servo is None else self._waited(servo, servo.obey(instruction, params))

    def _read_all(self, address: int, length: int, ids: Iterable[int]) -> bytes:
        asked = [self._servos[id] for id in ids if id in self._servos]
        return b"".join(self._waited(servo, servo.told(address, length)) for servo in asked)

    def _write_all(self, address: int, length: int, data: bytes) -> None:
        """`data` is an id and its bytes, again and again; nobody answers."""
        for at in range(0, len(data) - length, length + 1):
            servo = self._servos.get(data[at])
            if servo is not None:
                servo.write(address, data[at + 1 : at + 1 + length])

    def _waited(self, servo: Servo, reply: bytes) -> bytes:
        self.pause_s += servo.delay_s if reply else 0.0
        return reply
