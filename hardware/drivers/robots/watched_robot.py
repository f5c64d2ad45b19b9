"""A robot whose calls are timed: code of others has no time-out."""

from collections.abc import Callable
from typing import TypeVar

from hardware.drivers.arms.joint_reading import JointReading
from hardware.drivers.robots.robot import Robot
from hardware.transport.clock import Clock
from oio.core.records import Array, seconds

T = TypeVar("T")


class WatchedRobot:
    """A `Robot` around another: one thread calls, any other may ask how long the present call has lasted."""

    def __init__(self, robot: Robot, clock: Clock) -> None:
        self._robot, self._clock, self.name = robot, clock, robot.name
        self._since_ns: int | None = None  # None between two calls

    @property
    def call_s(self) -> float:
        """Duration of the present call [s]; 0 between two."""
        since_ns = self._since_ns
        return 0.0 if since_ns is None else seconds(self._clock.now_ns() - since_ns)

    def connect(self) -> None:
        """See `Robot`."""
        self._timed(self._robot.connect)

    def describe(self) -> str:
        """See `Robot`."""
        return self._timed(self._robot.describe)

    def read(self) -> JointReading:
        """See `Robot`."""
        return self._timed(self._robot.read)

    def write(self, set_point: Array) -> None:
        """See `Robot`."""
        self._timed(lambda: self._robot.write(set_point))

    def close(self) -> None:
        """See `Robot`."""
        self._timed(self._robot.close)

    def _timed(self, action: Callable[[], T]) -> T:
        self._since_ns = self._clock.now_ns()
        try:
            return action()
        finally:
            self._since_ns = None
