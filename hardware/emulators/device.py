"""Protocols of emulated devices and of the bench behind them. A device is pure: it has no port, no thread and no clock of its own."""

from collections.abc import Callable, Set
from typing import Protocol

from oio.core.records import Array

Raw = Callable[[int], float]  # raw value of an element's electronics at present
Trouble = Set[str]  # active fault kinds of `hardware.emulators.faults`; the server of the device updates the set


class Device(Protocol):
    """Protocol of an emulated device at the far end of one wire."""

    baud: int
    pause_s: float  # processing time of its last reply [s]
    boots_when_opened: bool  # as an Arduino, whose reset is wired to DTR

    def answer(self, data: bytes) -> bytes:
        """Process bytes from the host and return the reply; either may be empty, or cut at any byte."""
        ...

    def tick(self, t_s: float) -> bytes:
        """Advance to bench time t_s [s], measuring what is due; return the bytes sent unsolicited. Called once per tick of the bench."""
        ...

    def power_on(self, t_s: float) -> None:
        """Restart at t_s: its USB plug was reconnected, or opening its port has reset it."""
        ...


class Joints(Protocol):
    """Protocol of all joints of an arm, locked ones too, as seen by motors and encoders."""

    @property
    def count(self) -> int:
        """Number of joints."""
        ...

    def angles(self) -> Array:
        """Present angles (count,) [rad]."""
        ...

    def speeds(self) -> Array:
        """Angular velocities (count,) [rad/s]."""
        ...

    def loads(self) -> Array:
        """Torque over the largest torque of the motor (count,), -1 to 1."""
        ...

    def steer(self, joint: int, goal_rad: float) -> None:
        """Set a joint's goal angle [rad], held until the next one."""
        ...


class Electronics:
    """Raw sensor values as sent on the wire, with the faults saturated, stuck and dead."""

    def __init__(self, raw: Raw, full: float, trouble: Trouble) -> None:
        self._raw, self._full, self._trouble = raw, full, trouble
        self._last = dict[int, float]()

    def raw(self, element: int) -> float:
        """Return the raw value of one element."""
        if "dead" in self._trouble:
            return 0.0
        if "saturated" in self._trouble:
            return self._full
        if "stuck" not in self._trouble or element not in self._last:
            self._last[element] = self._raw(element)
        return self._last[element]
