"""No arm: the nose stands where it is, at the arm's home."""

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array, JointState, nanoseconds
from oio.kinematics.arm import Arm


class FixedMount:
    """Joint states all the same: whoever reads the log finds the nose where the configuration says it is."""

    def __init__(self, arm: Arm, period_s: float) -> None:
        self._home, self._period_ns, self._due_ns = arm.home, nanoseconds(period_s), 0

    def until(self, t_ns: int) -> list[JointState]:
        """Those that have become due."""
        nothing, due = np.zeros_like(self._home), list[JointState]()
        while self._due_ns <= t_ns:
            due.append(JointState(self._due_ns, self._home, nothing, nothing))
            self._due_ns += self._period_ns
        return due

    def move(self, goal: Array, over_s: float) -> float:
        """Raises BadInput for any goal but where it stands."""
        if not np.allclose(goal, self._home):
            raise BadInput(
                "a move was asked for, but backend.arm.driver=none has no arm. Type stage=[warm_up,baseline], or give "
                "backend.arm.driver=feetech backend.arm.port=..."
            )
        return over_s
