"""Fixed mount: no arm, the nose stays at the arm's home position."""

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array, JointState, nanoseconds
from oio.kinematics.arm import Arm


class FixedMount:
    """Source of constant joint states, so that the log holds the nose position of the configuration."""

    def __init__(self, arm: Arm, period_s: float) -> None:
        self._home, self._period_ns, self._due_ns = arm.home, nanoseconds(period_s), 0

    def until(self, t_ns: int) -> list[JointState]:
        """Return the joint states that have become due by t_ns."""
        zeros, due = np.zeros_like(self._home), list[JointState]()
        while self._due_ns <= t_ns:
            due.append(JointState(self._due_ns, self._home, zeros, zeros))
            self._due_ns += self._period_ns
        return due

    def move(self, goal: Array, over_s: float) -> float:
        """Accept only the home position as a goal. Raises BadInput for any other."""
        if not np.allclose(goal, self._home):
            raise BadInput(
                "a move was asked for, but backend.arm.driver=none has no arm. Type stage=[warm_up,baseline], or give "
                "backend.arm.driver=feetech backend.arm.port=..."
            )
        return over_s
