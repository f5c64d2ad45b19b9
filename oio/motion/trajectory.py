"""A way as it is gone along by a clock that may be late or turned back: the arm is then late, it never jumps."""

import math

from oio.core.records import Array
from oio.motion.path_planning import JointPath, duration_s, joints_at


class Trajectory:
    """Where the set-point is. It goes along its way by `step_s` seconds at most between two commands to the arm."""

    def __init__(self, q_rad: Array, step_s: float) -> None:
        self.q, self._step_s = q_rad, step_s  # (n,) rad
        self.now_s = -math.inf  # when it was last looked at
        self._way = JointPath()
        self._began_s = self._elapsed_s = self._lost_s = self._spent_s = 0.0

    @property
    def moving(self) -> bool:
        """Whether it is on its way still."""
        return bool(self._way)

    def take(self, way: JointPath) -> None:
        """Go along another way from now on; it begins where the set-point is."""
        self._way, self._began_s, self._elapsed_s, self._lost_s = way, self.now_s, 0.0, 0.0

    def given(self, t_s: float) -> Array:
        """The set-point (n,) at t_s, which is now commanded to the arm."""
        self.go_on(t_s)
        self._spent_s = 0.0
        return self.q

    def go_on(self, t_s: float) -> None:
        """Until t_s, but not farther than a command may go from the last one; time that is lost makes the way end later."""
        self.now_s = t_s
        if not self._way:
            return
        elapsed_s = (t_s - self._began_s) - self._lost_s
        wanted_s = elapsed_s - self._elapsed_s
        allowed_s = min(max(wanted_s, 0.0), max(self._step_s - self._spent_s, 0.0))
        if allowed_s != wanted_s:
            elapsed_s = self._elapsed_s + allowed_s
            self._lost_s = (t_s - self._began_s) - elapsed_s
        self._spent_s += allowed_s
        self._elapsed_s, self.q = elapsed_s, joints_at(self._way, elapsed_s)
        if elapsed_s >= duration_s(self._way):
            self._way = JointPath()
