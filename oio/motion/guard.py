"""The guard in front of every arm, simulated or real: every set-point comes from here. No key switches it off.

Whatever it is told, and whenever it is asked, it keeps the joints within their limits, the nose in its box, both below their speeds, and
every command a small step from the one before. Once it holds the arm, it holds it until it begins anew.
"""

import math

import numpy as np

from oio.core.errors import BadInput, OioError
from oio.core.records import Array
from oio.core.settings import in_range, settings
from oio.kinematics.arm import Arm
from oio.kinematics.minimum_jerk import PEAK_OVER_MEAN
from oio.motion.load_monitor import LoadLimits, LoadMonitor
from oio.motion.path_planning import Segment, box_violation_m, duration_s, plan
from oio.motion.trajectory import Trajectory

HOST, NOSE = "host", "nose"  # who must be heard while the arm moves
SPEED_TOLERANCE = 1.01  # of the speeds: a move begins at the set-point, which may be a tick short of the goal from which it was planned


@settings
class SafetyLimits:
    """Beyond which the arm is held. Limits of joints, nose box and speeds are the arm's own."""

    box_margin_m: float  # so far the nose may bow out of its box between two allowed poses
    step_s: float  # a command goes no farther than full speed takes in so long
    stale_s: float  # older commands are refused
    quiet_s: float  # the host, or the nose, may be silent so long while the arm moves,
    sample_s: float  # and the nose so long besides: its time between samples
    load: float  # of the torque a servo has; what is above it adds up,
    load_s: float  # and as much as that is in so many seconds of full torque holds the arm
    temperature_degc: float  # of a servo

    def check(self) -> None:
        """Refuse limits that hold nothing back, and those that hold everything."""
        in_range(self, box_margin_m=(0.0, 0.02), step_s=(0.001, 1.0), stale_s=(0.0, 10.0), quiet_s=(0.05, 60.0), sample_s=(0.0, 1e4))
        in_range(self, load=(0.05, 1.0), load_s=(0.01, 60.0), temperature_degc=(20.0, 100.0))

    @property
    def load_limits(self) -> LoadLimits:
        """Of every servo."""
        return LoadLimits(self.load, self.load_s, self.temperature_degc)


class Guard:
    """Live, but without a clock or a thread of its own: times [s] are its caller's, and so is the lock.

    `period_s`: between commands, if that is longer than `safety.step_s`. `joints`: so many turn on roundabout ways, the others are locked.
    """

    def __init__(self, arm: Arm, safety: SafetyLimits, period_s: float = 0.0, joints: int | None = None) -> None:
        self._arm, self._safety, self._joints = arm, safety, joints
        self._step_s = max(safety.step_s, period_s)
        self._quiet_s = {HOST: safety.quiet_s, NOSE: safety.quiet_s + safety.sample_s}
        self._stand(arm.home)
        self.held: str | None = "it has not begun"  # why the arm stands still until it begins anew, if it does

    def begin(self, q_rad: Array) -> None:
        """The arm stands at q_rad (n,) and may be moved, whatever held it before. Raises BadInput for a pose where it may not be."""
        q = np.array(q_rad, dtype=float)
        if not self._may_stand(q):
            self._arm.checked(q)  # which says why not
        self._stand(q)
        self.held = None

    def _may_stand(self, q: Array) -> bool:
        if q.shape != (self._arm.dof,) or not np.all((q >= self._arm.low_rad) & (q <= self._arm.high_rad)):
            return False
        return box_violation_m(self._arm, self._arm.nose(q)) <= self._safety.box_margin_m

    def _stand(self, q: Array) -> None:
        self._trajectory, self._load_monitor = Trajectory(q, self._step_s), LoadMonitor(self._safety.load_limits, self._arm.names)
        self._heard_s: dict[str, float] = {}

    @property
    def arrived(self) -> bool:
        """Whether the set-point is where it was sent."""
        return not self._trajectory.moving

    def stop(self, reason: str) -> None:
        """Hold the arm where it is. The first reason stays."""
        self.held = self.held or reason

    def move(self, q_rad: Array, over_s: float, t_s: float) -> float:
        """Take a command made at t_s: to q_rad (n,) within over_s; returns the seconds it takes, more if that were too fast.

        Raises BadInput for what may not be sent, and OioError while the arm is held; the arm then goes on as before.
        """
        goal = self._allowed(q_rad, over_s, t_s)
        self._trajectory.go_on(max(t_s, self._trajectory.now_s))
        way = plan(self._arm, self._trajectory.q, goal, self._safety.box_margin_m, self._joints)
        planned_s = duration_s(way)
        way = tuple(leg._replace(over_s=max(over_s * (leg.over_s / planned_s), self._fastest_s(leg))) for leg in way)
        self._trajectory.take(way)
        self._heard_s[HOST] = self._trajectory.now_s
        return duration_s(way)

    def set_point(self, t_s: float) -> Array:
        """Where the joints shall be (n,) rad at t_s; asked whenever the arm takes a command."""
        if self.held is None and math.isfinite(t_s):
            self._listen(t_s)
        if self.held is None and math.isfinite(t_s):
            return self._trajectory.given(t_s).copy()
        return self._trajectory.q.copy()

    def alive(self, t_s: float, who: str) -> None:
        """The host or the nose was heard at t_s."""
        if who not in self._quiet_s:
            raise BadInput(f"alive('{who}') was said, but a guard listens to {HOST} and {NOSE}.")
        if math.isfinite(t_s):
            self._heard_s[who] = t_s

    def feel(self, t_s: float, load: Array, temperature: Array | None = None) -> None:
        """Load (n,) of the servos, -1 to 1, and temperature (n,) degC at t_s; NaN where it is not known."""
        if math.isfinite(t_s) and (strained := self._load_monitor.feel(t_s, load, temperature)):
            self.stop(strained)

    def _listen(self, t_s: float) -> None:
        """Hold a moving arm when nothing was heard for too long; for a clock that was turned back the silence begins anew."""
        for who, quiet_s in self._quiet_s.items():
            self._heard_s[who] = min(self._heard_s.get(who, t_s), t_s)
            silent_s = t_s - self._heard_s[who]
            if self._trajectory.moving and silent_s > quiet_s:
                self.stop(f"the {who} was silent for {silent_s:.1f} s while the arm moved")

    def _allowed(self, q_rad: Array, over_s: float, t_s: float) -> Array:
        """The goal, if the command may be taken."""
        goal, n = np.array(q_rad, dtype=float), self._arm.dof
        if goal.shape != (n,) or not np.all(np.isfinite(goal)):
            raise BadInput(f"a move to {goal.tolist()} was asked for, but dof={n} takes {n} finite numbers. Type e.g. {[0.1] * n}.")
        if not (math.isfinite(over_s) and over_s > 0.0 and math.isfinite(t_s)):
            raise BadInput(f"a move over {over_s} s at {t_s} s was asked for, but it takes finite times and some time to move, e.g. 1.0 s.")
        late_s, most_s = self._trajectory.now_s - t_s, self._safety.stale_s
        if late_s > most_s:
            raise BadInput(f"a move came {late_s:.2f} s after it was commanded; safety.stale_s={most_s:g} s are allowed. Command it anew.")
        if self.held is not None:
            raise OioError(f"the arm is held where it is: {self.held}. It takes no move until it begins anew; see first that it can move.")
        return self._arm.checked(goal)

    def _fastest_s(self, leg: Segment) -> float:
        joints_s = PEAK_OVER_MEAN * float(np.max(np.abs(leg.turn))) / self._arm.joint_speed
        return max(joints_s, leg.rush_m / self._arm.nose_limit_m_s) / SPEED_TOLERANCE
