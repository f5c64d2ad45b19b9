"""The trajectory of the set-point along a planned path, with a clock that may be late, jump or run backwards: the arm is then late.

Between two commands to the arm the set-point advances by at most `step_s` of path time, so it never jumps.
"""

import math

from oio.core.records import Array
from oio.motion.path_planning import JointPath, duration_s, joints_at


class Trajectory:
    """The set-point in time. It stands still until it is given a path to follow."""

    def __init__(self, q_rad: Array, step_s: float) -> None:
        self.q, self._step_s = q_rad, step_s  # (n,) rad
        self.now_s = -math.inf  # time of the last call
        self._path = JointPath()
        self._began_s = self._elapsed_s = self._lost_s = self._spent_s = 0.0

    @property
    def moving(self) -> bool:
        """Whether the set-point has not reached the end of its path."""
        return bool(self._path)

    def follow(self, path: JointPath) -> None:
        """Follow another path from now on; it must begin at the set-point."""
        self._path, self._began_s, self._elapsed_s, self._lost_s = path, self.now_s, 0.0, 0.0

    def command(self, t_s: float) -> Array:
        """The set-point (n,) rad at t_s, which is now sent to the arm."""
        self.advance(t_s)
        self._spent_s = 0.0
        return self.q

    def advance(self, t_s: float) -> None:
        """Advance to t_s, but by no more than `step_s` since the last command; the rest of the path is delayed by what is lost."""
        self.now_s = t_s
        if not self._path:
            return
        elapsed_s = (t_s - self._began_s) - self._lost_s
        wanted_s = elapsed_s - self._elapsed_s
        allowed_s = min(max(wanted_s, 0.0), max(self._step_s - self._spent_s, 0.0))
        if allowed_s != wanted_s:
            elapsed_s = self._elapsed_s + allowed_s
            self._lost_s = (t_s - self._began_s) - elapsed_s
        self._spent_s += allowed_s
        self._elapsed_s, self.q = elapsed_s, joints_at(self._path, elapsed_s)
        if elapsed_s >= duration_s(self._path):
            self._path = JointPath()
