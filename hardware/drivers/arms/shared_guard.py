"""Guard of an arm, shared between the thread that reads and leads it and the threads that command it."""

import math
import threading

import numpy as np

from hardware.drivers.arms.control import ArmControl
from hardware.drivers.arms.joint_reading import JointReading
from hardware.transport.clock import Clock
from oio.core.errors import OioError
from oio.core.records import Array, seconds
from oio.gas.source import unlocked
from oio.kinematics.arm import Arm
from oio.motion.guard import HOST, NOSE, Guard, SafetyLimits
from oio.motion.guard_account import GuardAccount

MAX_SUSPENDED_S = 1.0  # a host that was suspended for longer does not know what happened meanwhile


class SharedGuard:
    """Guard behind a lock, for all joints: locked ones are held at home. After a fault the measured pose is held, not the set-point.

    `elsewhere`: what to do if the arm stands elsewhere than it says. `hold_step_rad`: the set-point goes to a pose that is held by steps of
    this size at most, where what the arm says may be wrong.
    """

    def __init__(
        self, control: ArmControl, arm: Arm, safety: SafetyLimits, clock: Clock, elsewhere: str, hold_step_rad: float = math.inf
    ) -> None:  # fmt: skip
        self._whole, self._clock, self._elsewhere, self._hold_step_rad = unlocked(arm), clock, elsewhere, hold_step_rad
        self._locked, self._moved_by_hand_rad = np.array(arm.home_rad[arm.dof :]), math.radians(control.moved_by_hand_deg)
        self._lock, self._guard = threading.Lock(), Guard(self._whole, safety, control.period_s, arm.dof)
        self.begun = False
        self.set_point = self._whole.home  # (n,) rad, the last one that `next_set_point` gave
        self._held_pose_rad: Array | None = None  # measured pose held after a fault, so as not to press on against an obstacle

    def connect(self, q: Array) -> None:
        """Begin, or resume, with the joints at q (n,) rad. Raises OioError outside the limits: no safe path from there is known."""
        with self._lock:
            for who in (HOST, NOSE):  # the arm was away, not the host or the nose
                self._guard.heartbeat(self._now_s(), who)
            moved = np.max(np.abs(q - self._guard.set_point(self._now_s()))) > self._moved_by_hand_rad
            if moved or not self.begun:
                self._refuse_outside(q)
            if not self.begun or (moved and self._guard.held is None):
                self._guard.begin(q)
                self.begun = True
            elif moved:
                self._held_pose_rad = q  # the hold persists, but at the present pose

    def next_set_point(self, gas_ns: int | None) -> Array:
        """Set-point (n,) rad for now; `gas_ns`: time of the last gas sample, the heartbeat of the nose [ns, world clock]."""
        with self._lock:
            if gas_ns is not None:
                self._guard.heartbeat(seconds(gas_ns), NOSE)
            if self._clock.suspended_s > MAX_SUSPENDED_S:
                self._guard.stop("the computer was suspended")
            goal = self._guard.set_point(self._now_s())
            self.set_point = goal if self._held_pose_rad is None else self._step_toward(self._held_pose_rad)
        return self.set_point

    def _step_toward(self, held: Array) -> Array:
        step = held - self.set_point
        longest = float(np.max(np.abs(step)))
        return held if longest <= self._hold_step_rad else self.set_point + step * (self._hold_step_rad / longest)

    def report(self, t_s: float, reading: JointReading) -> None:
        """Take what the arm said of its joints at t_s [s]. May stop the arm."""
        with self._lock:
            was_free = self._guard.held is None
            self._guard.report_load(t_s, reading.load, reading.temperature_degc)
            if reading.fault is not None:
                self._guard.stop(reading.fault)
            if was_free and self._guard.held is not None and reading.is_plausible:
                self._held_pose_rad = np.clip(reading.q, self._whole.low_rad, self._whole.high_rad)

    def move(self, goal: Array, over_s: float) -> float:
        """Start a move of the unlocked joints to goal (n,) rad; return its duration [s]. Raises what the guard refuses."""
        with self._lock:
            return self._guard.move(np.concatenate([goal, self._locked]), over_s, self._now_s())

    def heartbeat(self) -> None:
        """Heartbeat of the host: it is still asking for samples."""
        with self._lock:
            self._guard.heartbeat(self._now_s(), HOST)

    def stop(self, why: str) -> None:
        """Hold the arm permanently."""
        with self._lock:
            self._guard.stop(why)

    def account(self) -> GuardAccount:
        """What the arm was held to so far."""
        with self._lock:
            return self._guard.account()

    @property
    def held(self) -> str | None:
        """Reason of a permanent hold; None while the arm may move."""
        with self._lock:
            return self._guard.held

    @property
    def distance_from_home_rad(self) -> float:
        """Largest distance of a joint's set-point from home [rad]."""
        with self._lock:
            return float(np.max(np.abs(self._guard.set_point(self._now_s()) - self._whole.home)))

    def _now_s(self) -> float:
        return seconds(self._clock.now_ns())

    def _refuse_outside(self, q: Array) -> None:
        if not self._whole.is_allowed(q):
            degrees = ", ".join(f"{name} {math.degrees(angle):.0f}" for name, angle in zip(self._whole.all_names, q, strict=True))
            home = ", ".join(f"{math.degrees(angle):.0f}" for angle in self._whole.home_rad)
            raise OioError(
                f"the arm stands at {degrees} degrees, nose at {np.round(self._whole.nose(q), 2).tolist()} m, where it may not be. It was "
                f"not switched on. Put it by hand near its home ({home} degrees) and start again; {self._elsewhere}."
            )
