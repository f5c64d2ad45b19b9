"""The safety guard in front of every arm, simulated or real: every set-point that an arm gets comes from here. No key switches it off.

Whatever the commands and their times, joints stay within their limits, the nose in its box, both below their speed limits, and a set-point
is a small step from the one before. NaN, infinity and stale commands are refused. A stop lasts until the guard is begun again.
"""

import math
from typing import Annotated

import numpy as np

from oio.core.errors import BadInput, OioError
from oio.core.records import Array
from oio.core.settings import Within, settings
from oio.kinematics.arm import Arm
from oio.kinematics.minimum_jerk import PEAK_OVER_MEAN
from oio.motion.guard_account import CommandedTrack, GuardAccount, without_limit
from oio.motion.load_monitor import LoadLimits, LoadMonitor
from oio.motion.path_planning import Segment, box_violation_m, duration_s, plan
from oio.motion.trajectory import Trajectory

HOST, NOSE = "host", "nose"  # whose heartbeats are required while the arm moves
SPEED_TOLERANCE = 1.01  # a move starts at the set-point, which may be a tick short of the goal from which the caller planned it


@settings
class SafetyLimits:
    """Limits beyond which the arm is stopped. Limits of joints, nose box and speeds are the arm's own."""

    box_margin_m: Annotated[float, Within(0, 0.02)]  # by which the nose may leave its box on a curved path between two allowed poses
    step_s: Annotated[float, Within(0.001, 1)]  # path time between two set-points, at most
    command_age_s: Annotated[float, Within(0, 10)]  # commands older than this are refused
    heartbeat_timeout_s: Annotated[float, Within(0.05, 60)]  # time-out of the heartbeats of host and nose while the arm moves,
    sample_s: Annotated[float, Within(0, 1e4)]  # longer by this for the nose: its sampling period
    load: Annotated[float, Within(0.05, 1)]  # fraction of a servo's torque; what is above it adds up,
    load_s: Annotated[float, Within(0.01, 60)]  # to a stop after so many seconds of full torque
    temperature_degc: Annotated[float, Within(20, 100)]  # of a servo

    @property
    def load_limits(self) -> LoadLimits:
        """Of every servo."""
        return LoadLimits(self.load, self.load_s, self.temperature_degc)


class Guard:
    """Stateful, but without a clock, a thread or a lock: times [s] are given by its caller, who also serialises the calls.

    `period_s`: between set-points, if longer than `safety.step_s`. `joints`: how many move on paths over via poses (others are braked).
    """

    def __init__(self, arm: Arm, safety: SafetyLimits, period_s: float = 0.0, joints: int | None = None) -> None:
        self._arm, self._safety, self._joints = arm, safety, joints
        self._step_s = max(safety.step_s, period_s)
        self._timeout_s = {HOST: safety.heartbeat_timeout_s, NOSE: safety.heartbeat_timeout_s + safety.sample_s}
        self._track = CommandedTrack(arm)
        self._stand(arm.home)
        self.held: str | None = "it has not begun"  # why the arm is stopped, None if it is not

    def begin(self, q_rad: Array) -> None:
        """Start, or start again after a stop, with the arm at q_rad (n,). Raises BadInput for a pose outside limits or box."""
        q = np.array(q_rad, dtype=float)
        if not self._may_stand(q):
            self._arm.validated(q)  # raises, with the reason
        self._stand(q)
        self.held = None

    def _may_stand(self, q: Array) -> bool:
        if q.shape != (self._arm.dof,) or not np.all((q >= self._arm.low_rad) & (q <= self._arm.high_rad)):
            return False
        return box_violation_m(self._arm, self._arm.nose(q)) <= self._safety.box_margin_m

    def _stand(self, q: Array) -> None:
        self._trajectory, self._load_monitor = Trajectory(q, self._step_s), LoadMonitor(self._safety.load_limits, self._arm.names)
        self._heard_s: dict[str, float] = {}
        self._track.restart()

    def account(self) -> GuardAccount:
        """What the arm was held to since the guard was made."""
        arm = self._arm
        return GuardAccount(without_limit(arm), self._track.top_speed_m_s, arm.nose_limit_m_s, self._load_monitor.unwatched)

    @property
    def arrived(self) -> bool:
        """Whether the set-point has reached its goal."""
        return not self._trajectory.moving

    def stop(self, reason: str) -> None:
        """Stop the arm where it is; of several reasons the first is kept."""
        self.held = self.held or reason

    def move(self, q_rad: Array, over_s: float, t_s: float) -> float:
        """Accept a command given at t_s: move to q_rad (n,) in over_s. Returns the duration [s], longer if that would be too fast.

        The path is planned here, from the set-point, whatever the caller has planned: nothing that reaches an arm is taken on trust.
        Raises BadInput for a command that is not allowed, and OioError while the arm is stopped; the motion under way is not affected.
        """
        goal = self._allowed(q_rad, over_s, t_s)
        self._trajectory.advance(max(t_s, self._trajectory.now_s))
        path = plan(self._arm, self._trajectory.q, goal, self._safety.box_margin_m, self._joints)
        planned_s = duration_s(path)
        path = tuple(part._replace(over_s=max(over_s * (part.over_s / planned_s), self._fastest_s(part))) for part in path)
        self._trajectory.follow(path)
        self._heard_s[HOST] = self._trajectory.now_s
        return duration_s(path)

    def set_point(self, t_s: float) -> Array:
        """The set-point (n,) rad at t_s, which is sent to the arm."""
        if self.held is None and math.isfinite(t_s):
            self._check_heartbeats(t_s)
        if self.held is None and math.isfinite(t_s):
            q = self._trajectory.command(t_s).copy()
            self._track.add(t_s, q)
            return q
        return self._trajectory.q.copy()

    def heartbeat(self, t_s: float, who: str) -> None:
        """Heartbeat of `who`, HOST or NOSE, at t_s. Raises BadInput for anything else."""
        if who not in self._timeout_s:
            raise BadInput(f"a heartbeat of '{who}' was given, but a guard expects those of {HOST} and {NOSE}.")
        if math.isfinite(t_s):
            self._heard_s[who] = t_s

    def report_load(self, t_s: float, load: Array, temperature: Array | None = None) -> None:
        """Load (n,) of the servos, -1 to 1, and temperature (n,) degC at t_s; NaN where unknown. Too much of either stops the arm."""
        if math.isfinite(t_s) and (overload := self._load_monitor.check(t_s, load, temperature)):
            self.stop(overload)

    def _check_heartbeats(self, t_s: float) -> None:
        """Stop a moving arm when a heartbeat is overdue; the time-out restarts when the clock runs backwards."""
        for who, timeout_s in self._timeout_s.items():
            self._heard_s[who] = min(self._heard_s.get(who, t_s), t_s)
            silent_s = t_s - self._heard_s[who]
            if self._trajectory.moving and silent_s > timeout_s:
                self.stop(f"the {who} was silent for {silent_s:.1f} s while the arm moved")

    def _allowed(self, q_rad: Array, over_s: float, t_s: float) -> Array:
        """The goal (n,) rad, if the command is allowed."""
        goal, n = np.array(q_rad, dtype=float), self._arm.dof
        if goal.shape != (n,) or not np.all(np.isfinite(goal)):
            raise BadInput(f"a move to {goal.tolist()} was asked for, but dof={n} takes {n} finite numbers. Type e.g. {[0.1] * n}.")
        if not (math.isfinite(over_s) and over_s > 0.0 and math.isfinite(t_s)):
            raise BadInput(f"a move over {over_s} s at {t_s} s was asked for, but it takes finite times and some time to move, e.g. 1.0 s.")
        late_s, most_s = self._trajectory.now_s - t_s, self._safety.command_age_s
        if late_s > most_s:
            raise BadInput(
                f"a move came {late_s:.2f} s after it was commanded; safety.command_age_s={most_s:g} s are allowed. Command it anew."
            )
        if self.held is not None:
            raise OioError(f"the arm is held where it is: {self.held}. It takes no move until it begins anew; see first that it can move.")
        return self._arm.validated(goal)

    def _fastest_s(self, segment: Segment) -> float:
        """The shortest duration that the speed limits allow."""
        joints_s = PEAK_OVER_MEAN * float(np.max(np.abs(segment.delta))) / self._arm.joint_speed
        return max(joints_s, segment.peak_m / self._arm.nose_limit_m_s) / SPEED_TOLERANCE
