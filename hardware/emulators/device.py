"""What an emulated device is, and what it needs of the bench. A device is pure: it knows no port, no thread and no clock of its own."""

from collections.abc import Callable, Set
from typing import Protocol

from oio.core.records import Array

Raw = Callable[[int], float]  # the value that an element's electronics put on the wire now
Trouble = Set[str]  # kinds of `hardware.emulators.faults` that a device has now; whoever serves it changes the set


class Device(Protocol):
    """At the far end of one wire."""

    baud: int
    pause_s: float  # how long it thought over its last answer
    boots_when_opened: bool  # as an Arduino does, whose reset hangs on DTR

    def answer(self, data: bytes) -> bytes:
        """What the host sent, to what goes back; either may be nothing, and cut anywhere."""
        ...

    def spoken(self, t_s: float) -> bytes:
        """Called once each tick of the bench, at its time t_s: the device measures what is due, and says what it says unasked."""
        ...

    def powered(self, t_s: float) -> None:
        """It begins anew: its USB plug was out and is in again, or whoever opened its port has reset it."""
        ...


class Joints(Protocol):
    """All joints of an arm, locked ones too, as motors and encoders have them."""

    @property
    def count(self) -> int:
        """How many."""
        ...

    def angles(self) -> Array:
        """rad (count,) now."""
        ...

    def speeds(self) -> Array:
        """rad/s (count,)."""
        ...

    def loads(self) -> Array:
        """Torque over the most that a motor can do (count,), -1 to 1."""
        ...

    def steer(self, joint: int, goal_rad: float) -> None:
        """Hold this from now on."""
        ...


class Electronics:
    """A sensor's raw values as they reach the wire: at their rail or stuck, if that is the trouble."""

    def __init__(self, raw: Raw, full: float, trouble: Trouble) -> None:
        self._raw, self._full, self._trouble = raw, full, trouble
        self._last = dict[int, float]()

    def raw(self, element: int) -> float:
        """Of one element."""
        if "saturated" in self._trouble:
            return self._full
        if "stuck" not in self._trouble or element not in self._last:
            self._last[element] = self._raw(element)
        return self._last[element]
