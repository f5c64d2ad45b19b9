"""The plant in real time, and what devices can know of it."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hardware.simulation.plant import Plant
from oio.core.records import Array, seconds
from oio.kinematics.arm import Arm

MAX_LATE_S = 0.25  # of the host: a plant that is later than this gives up the time it lost, or it would hurry for ever


@dataclass(frozen=True, slots=True)
class _State:
    t_s: float
    angles: Array  # rad, all joints
    loads: Array


class RealtimePlant:
    """`speed` seconds of the plant pass in one of the host.

    The plant is always one tick ahead of the clock: between ticks an encoder turns evenly from one angle to the next, so it can be asked
    a hundred times a second, and at any time, with ticks as long as those of `backend=mujoco`. Locked joints stay at home.
    """

    def __init__(self, plant: Plant, arm: Arm, speed: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._plant, self._speed, self._clock = plant, speed, clock
        self._home, self._dof = np.array(arm.home_rad), arm.dof
        self._goals = self._home.copy()
        self._began_s, self.slipped_s = clock(), 0.0  # slipped: seconds of the host that were given up
        self._before = self._after = self._state()

    def _state(self) -> _State:
        angles, loads = self._home.copy(), np.zeros(len(self._home))
        angles[: self._dof], loads[: self._dof] = self._plant.turned(), self._plant.load()
        return _State(seconds(self._plant.t_ns), angles, loads)

    def begin(self) -> None:
        """Time passes from now on."""
        self._began_s = self._clock() - self._before.t_s / self._speed

    @property
    def t_s(self) -> float:
        """Seconds of the plant's world now; it waits if the plant is late."""
        return min(max((self._clock() - self._began_s) * self._speed, self._before.t_s), self._after.t_s)

    @property
    def due_s(self) -> float:
        """When the next tick is due, by the host's clock."""
        return self._began_s + self._after.t_s / self._speed

    @property
    def tick_s(self) -> float:
        """The plant's time of the tick that is due next: it has come that far."""
        return self._after.t_s

    def tick(self) -> None:
        """Let the plant go on; devices must have seen it as it was."""
        late_s = self._clock() - self.due_s
        if late_s > MAX_LATE_S:
            self._began_s += late_s
            self.slipped_s += late_s
        self._plant.tick(self._goals[: self._dof])
        self._before, self._after = self._after, self._state()

    def raw(self, element: int) -> float:
        """See `Plant`."""
        return self._plant.raw(element)

    def present(self, source: str) -> None:
        """See `Plant`."""
        self._plant.present(source)

    @property
    def count(self) -> int:
        """See `Joints`."""
        return len(self._home)

    def angles(self) -> Array:
        """See `Joints`."""
        before, after = self._before, self._after
        if after is before:
            return after.angles
        share = (self.t_s - before.t_s) / (after.t_s - before.t_s)
        return np.asarray(before.angles + share * (after.angles - before.angles))

    def speeds(self) -> Array:
        """See `Joints`."""
        before, after = self._before, self._after
        return np.zeros(self.count) if after is before else np.asarray((after.angles - before.angles) / (after.t_s - before.t_s))

    def loads(self) -> Array:
        """See `Joints`."""
        return self._after.loads

    def steer(self, joint: int, goal_rad: float) -> None:
        """See `Joints`; locked joints have their brakes on."""
        self._goals[joint] = goal_rad
