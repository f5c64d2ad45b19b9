"""The world as stages see it: every sample is logged before a stage sees it, every command is checked before the arm does."""

import math
from collections.abc import Iterator

import numpy as np

from oio.core import interrupt
from oio.core.interfaces import World
from oio.core.records import Array, Event, GasSample, JointState, Sample
from oio.kinematics.arm import Arm
from oio.log import RunLog
from oio.motion.path_planning import duration_s, plan


class GuardedWorld:
    """A world that is logged and guarded: every sample reaches the log before a stage sees it, every command is checked.

    Truth goes to the log only; no stage can see it through this door. Nor can it see gas at the sensor's upper rail (`highest_raw`): a
    fit that took it for a value would put the source where the gas is just so strong.
    """

    def __init__(self, world: World, arm: Arm, log: RunLog, highest_raw: float = math.inf) -> None:
        self._world, self._arm, self._log, self._highest_raw = world, arm, log, highest_raw
        self._goal = arm.home

    @property
    def t_ns(self) -> int:
        """Nanoseconds since the world opened."""
        return self._world.t_ns

    def samples(self, for_s: float) -> Iterator[Sample]:
        """Let `for_s` seconds pass; yield joint states and gas samples in time order."""
        # where a span began: worlds end a span on their own ticks, and a replay must end it where this one did
        self._log.write(Event(self.t_ns, "span", repr(float(for_s))))
        for sample in self._world.samples(for_s):
            self._log.write(sample)
            interrupt.check()
            if isinstance(sample, JointState) or (isinstance(sample, GasSample) and sample.raw < self._highest_raw):
                yield sample

    def move(self, q_rad: Array) -> float:
        """Begin a smooth move to q_rad (n,); returns the seconds it takes. Raises BadInput for a goal out of limits or without a way."""
        goal = self._arm.checked(q_rad)
        over_s = self.move_s(goal)
        self._log.write(Event(self.t_ns, "move", move_text(goal, over_s)))
        self._goal = goal
        return self._world.move(goal, over_s)

    def move_s(self, q_rad: Array) -> float:
        """Seconds that a move to q_rad (n,) would take. Raises BadInput if there is no way on which the nose stays in its box."""
        return duration_s(plan(self._arm, self._goal, q_rad))

    def present(self, source: str) -> None:
        """Open one gas source: `none`, `beacon` or `source`. What was sensed before it was open goes to the log, and to no stage."""
        self._log.write(Event(self.t_ns, "present", source))
        self._world.present(source)
        for _ in self.samples(0.0):  # a real world went on while nobody asked: its nose smelt the source before
            pass

    @property
    def goal(self) -> Array:
        """The joints (n,) rad last asked for."""
        return self._goal


def move_text(goal: Array, over_s: float) -> str:
    """How a command stands in the log; a replay compares its commands with these."""
    return f"{float(over_s)!r} s to {np.round(goal, 4).tolist()}"
