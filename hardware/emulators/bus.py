"""Emulated servo bus of any maker: addressing, order of the replies, and return delays."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from typing import Protocol

from hardware.emulators.device import Trouble

TICK_S = 2e-6  # unit of the return delay register, for both makers


class Servo(Protocol):
    """Protocol of one emulated servo with its maker's registers."""

    @property
    def delay_s(self) -> float:
        """Return delay before a reply [s]."""
        ...

    def tick(self, t_s: float) -> None:
        """Advance to bench time t_s [s]."""
        ...

    def power_on(self) -> None:
        """Restart after a supply failure, with torque disabled."""
        ...

    def obey(self, instruction: int, params: bytes) -> bytes:
        """Execute an instruction; return its status packet, or nothing."""
        ...

    def told(self, address: int, length: int) -> bytes:
        """Return the status packet of a read."""
        ...

    def write(self, address: int, data: bytes) -> int:
        """Write registers; return the error code, or 0."""
        ...


class Bus(ABC):
    """Base class of an emulated bus; a maker's class implements `_answer`."""

    baud, boots_when_opened = 1_000_000, False

    def __init__(self, servos: Mapping[int, Servo], trouble: Trouble) -> None:
        self.pause_s, self._servos, self._trouble = 0.0, servos, trouble

    def power_on(self, t_s: float) -> None:
        """Do nothing: the USB plug powers the adapter only, the servos have a supply of their own."""
        return

    def tick(self, t_s: float) -> bytes:
        """Advance all servos; they send nothing unsolicited."""
        for servo in self._servos.values():
            if "brownout" in self._trouble:
                servo.power_on()
            servo.tick(t_s)
        return b""

    def answer(self, data: bytes) -> bytes:
        """Return the status packets, one after the other."""
        self.pause_s = 0.0
        return b"" if "brownout" in self._trouble else self._answer(data)

    @abstractmethod
    def _answer(self, data: bytes) -> bytes:
        """Execute what the host sent; return the status packets."""

    def _one(self, id: int, instruction: int, params: bytes) -> bytes:
        servo = self._servos.get(id)
        return b"" if servo is None else self._with_delay(servo, servo.obey(instruction, params))

    def _read_all(self, address: int, length: int, ids: Iterable[int]) -> bytes:
        asked = [self._servos[id] for id in ids if id in self._servos]
        return b"".join(self._with_delay(servo, servo.told(address, length)) for servo in asked)

    def _write_all(self, address: int, length: int, data: bytes) -> None:
        """Sync write: `data` repeats an id and its bytes; no servo replies."""
        for at in range(0, len(data) - length, length + 1):
            servo = self._servos.get(data[at])
            if servo is not None:
                servo.write(address, data[at + 1 : at + 1 + length])

    def _with_delay(self, servo: Servo, reply: bytes) -> bytes:
        self.pause_s += servo.delay_s if reply else 0.0
        return reply
