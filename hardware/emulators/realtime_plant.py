"""Real-time plant: the simulated plant paced by the host clock, as the emulated devices observe it."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hardware.simulation.plant import Plant
from oio.core.records import Array, seconds
from oio.kinematics.arm import Arm

MAX_LATE_S = 0.25  # a plant that is later than this [host s] drops the time lost, else it would run at full speed to catch up


@dataclass(frozen=True, slots=True)
class _State:
    t_s: float
    angles: Array  # rad, all joints
    loads: Array


class RealtimePlant:
    """Plant of which `speed` seconds pass per host second.

    The plant is always one tick ahead of the clock. Between ticks joint angles are interpolated linearly, so encoders can be read at any
    time, a hundred times a second, with ticks as long as those of `backend=mujoco`. Locked joints stay at home.
    """

    def __init__(self, plant: Plant, arm: Arm, speed: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._plant, self._speed, self._clock = plant, speed, clock
        self._home, self._dof = np.array(arm.home_rad), arm.dof
        self._goals = self._home.copy()
        self._start_s, self.slipped_s = clock(), 0.0  # slipped: time dropped [host s]
        self._before = self._after = self._state()

    def _state(self) -> _State:
        angles, loads = self._home.copy(), np.zeros(len(self._home))
        angles[: self._dof], loads[: self._dof] = self._plant.fine_angles(), self._plant.load()
        return _State(seconds(self._plant.t_ns), angles, loads)

    def begin(self) -> None:
        """Start the clock."""
        self._start_s = self._clock() - self._before.t_s / self._speed

    @property
    def t_s(self) -> float:
        """Plant time [s] now; it waits for a plant that is late."""
        return min(max((self._clock() - self._start_s) * self._speed, self._before.t_s), self._after.t_s)

    @property
    def due_s(self) -> float:
        """Host time of the next tick [s]."""
        return self._start_s + self._after.t_s / self._speed

    @property
    def tick_s(self) -> float:
        """Plant time of the next tick [s], up to which the plant has been computed."""
        return self._after.t_s

    def tick(self) -> None:
        """Advance the plant; the devices must have observed the present state before."""
        late_s = self._clock() - self.due_s
        if late_s > MAX_LATE_S:
            self._start_s += late_s
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
        fraction = (self.t_s - before.t_s) / (after.t_s - before.t_s)
        return np.asarray(before.angles + fraction * (after.angles - before.angles))

    def speeds(self) -> Array:
        """See `Joints`."""
        before, after = self._before, self._after
        return np.zeros(self.count) if after is before else np.asarray((after.angles - before.angles) / (after.t_s - before.t_s))

    def loads(self) -> Array:
        """See `Joints`."""
        return self._after.loads

    def steer(self, joint: int, goal_rad: float) -> None:
        """See `Joints`; locked joints do not move."""
        self._goals[joint] = goal_rad
