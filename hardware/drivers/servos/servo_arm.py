"""Servo arm driver: reads the joints and sends guarded set-points about a hundred times a second, in the same cycle."""

import math
import threading
import time
from collections import Counter

import numpy as np

from hardware.drivers.servos.bus import Positions, ServoState
from hardware.drivers.servos.finite_differences import FiniteDifferences
from hardware.drivers.servos.jitter import Jitter
from hardware.drivers.servos.port import ArmPort
from hardware.drivers.servos.servo_health import HealthMonitor
from hardware.drivers.servos.tracking_error import TrackingErrorMonitor
from hardware.transport.clock import Clock
from hardware.transport.driver import Counts
from hardware.transport.mailbox import Mailbox, StampedSample
from hardware.transport.port import NoAnswer, Wire
from oio.core.errors import OioError
from oio.core.records import Array, nanoseconds, seconds
from oio.gas.source import unlocked
from oio.kinematics.arm import Arm
from oio.kinematics.homing import Homing
from oio.motion.guard import HOST, NOSE, Guard, SafetyLimits

MAX_SLEEP_S = 0.02  # at a time, so that the thread can end
MAX_SUSPENDED_S = 1.0  # a host that was suspended for longer does not know what happened meanwhile


class ServoArm:
    """Driver of all joints of an arm; locked joints are held at home."""

    key = "backend.arm"

    def __init__(self, port: ArmPort, arm: Arm, safety: SafetyLimits, mailbox: Mailbox, clock: Clock) -> None:
        self._bus, self._arm, self._whole = (bus := port.bus()), arm, unlocked(arm)
        self._homing = arm.homed or Homing.nominal(len(arm.all_names), bus.middle)
        self._mailbox, self._clock, self._period_ns, self._release_torque = (
            mailbox,
            clock,
            nanoseconds(port.period_s),
            port.torque_off_at_end,
        )
        self._tracking_error = TrackingErrorMonitor(arm.all_names, port.tracking_error_deg, port.tracking_error_s)
        self.name, self.baud = bus.name, bus.baud
        self._ids = list(range(1, len(arm.all_names) + 1))
        self._locked = np.array(arm.home_rad[arm.dof :])
        self._lock, self._guard = threading.Lock(), Guard(self._whole, safety, port.period_s, arm.dof)
        self._differences, self.jitter, self._rounds, self._configured = FiniteDifferences(), Jitter(), 0, False
        self._due_ns, self._lost, self._set_point_rad = 0, 0, self._whole.home
        self._moved_by_hand_rad = math.radians(port.moved_by_hand_deg)
        self._health = HealthMonitor(len(self._ids), port.health_every, port.fault_cycles)
        self._held_pose_rad: Array | None = None  # measured pose held after a fault, so as not to press on against an obstacle

    def identify(self, wire: Wire) -> str | None:
        """Return the models of the servos that answer."""
        models = {servo: self._bus.ping(wire, servo) for servo in self._ids}
        found = [f"{servo} {model}" for servo, model in models.items() if model]
        return f"servos {', '.join(found)}" if found else None

    def configure(self, wire: Wire) -> None:
        """Enable torque at the present pose. Raises OioError outside the limits: no safe path from there is known."""
        missing = [servo for servo in self._ids if self._bus.ping(wire, servo) is None]
        if missing:
            raise NoAnswer(f"servo {missing[0]} of {len(self._ids)} does not answer")
        self._bus.configure(wire, self._ids)
        q = self._angles(self._bus.read_state(wire, self._ids))
        with self._lock:
            for who in (HOST, NOSE):  # the arm was away, not the host or the nose
                self._guard.heartbeat(self._now_s(), who)
            moved = np.max(np.abs(q - self._guard.set_point(self._now_s()))) > self._moved_by_hand_rad
            if moved or not self._configured:
                self._refuse_outside(q)
            if not self._configured or (moved and self._guard.held is None):
                self._guard.begin(q)
                self._configured = True
            elif moved:
                self._held_pose_rad = q  # the hold persists, but at the present pose
        self._send_set_point(wire)
        for servo, count in zip(self._ids, self._goal_counts(), strict=True):  # writes are not acknowledged; a stale goal makes it jump
            if (goal := self._bus.health(wire, servo).goal) != count:
                raise NoAnswer(f"servo {servo} was given the goal {count}, but has {goal}: see the limits in its memory")
        self._bus.torque(wire, self._ids, True)

    def poll(self, wire: Wire) -> bool:
        """Read the joints, send the set-point and, every `health_every` cycles, read the health of one servo."""
        wait_s = self._clock.host_s(seconds(self._due_ns - self._clock.now_ns()))
        if wait_s > 0:
            time.sleep(min(wait_s, MAX_SLEEP_S))
            return False
        self._due_ns = max(self._due_ns, self._clock.now_ns() - self._period_ns) + self._period_ns
        try:
            asked_ns = self._clock.now_ns()
            state = self._bus.read_state(wire, self._ids)
            arrived_ns = self._clock.now_ns()
            self._report(state, (asked_ns + arrived_ns) // 2, arrived_ns)
            self._monitor_health(wire, state)
        except NoAnswer:
            self._lost += 1
            raise
        finally:
            self._send_set_point(wire)
        return True

    def release(self, wire: Wire) -> None:
        """Stop at the present pose; torque stays enabled unless the configuration disables it."""
        if not self._configured:
            return
        with self._lock:
            self._guard.stop("the run is over")
        self._send_set_point(wire)
        if self._release_torque:
            self._bus.torque(wire, self._ids, False)

    def move(self, goal: Array, over_s: float) -> float:
        """Start a move of the unlocked joints to goal (n,) rad; return its duration [s]. Raises what the guard refuses."""
        with self._lock:
            return self._guard.move(np.concatenate([goal, self._locked]), over_s, self._now_s())

    def heartbeat(self) -> None:
        """Heartbeat of the host: it is still asking for samples."""
        with self._lock:
            self._guard.heartbeat(self._now_s(), HOST)

    @property
    def distance_from_home_rad(self) -> float:
        """Largest distance of a joint's set-point from home [rad]."""
        with self._lock:
            return float(np.max(np.abs(self._guard.set_point(self._now_s()) - self._whole.home)))

    def stop(self, why: str) -> None:
        """Hold the arm permanently."""
        with self._lock:
            self._guard.stop(why)

    @property
    def health_summary(self) -> str:
        """Lowest supply voltage and highest temperature read so far, as text."""
        return self._health.summary

    @property
    def held(self) -> str | None:
        """Reason of a permanent hold; None while the arm may move."""
        with self._lock:
            return self._guard.held

    def counts(self) -> Counts:
        """Frames and polling cycles so far."""
        f = self._bus.framer()
        return Counter(good=f.good, corrupt=f.corrupt, skipped=f.skipped, lost=self._lost, rounds=self._rounds)

    def _now_s(self) -> float:
        return seconds(self._clock.now_ns())

    def _angles(self, state: ServoState) -> Array:
        return self._homing.angles(state.counts, self._bus.counts_per_turn)

    def _report(self, state: ServoState, t_ns: int, arrived_ns: int) -> None:
        self._rounds += 1
        self.jitter.beat(t_ns)
        q, t_s = self._angles(state), seconds(t_ns)
        self._mailbox.put(StampedSample(self._differences.state(t_ns, q[: self._arm.dof]), arrived_ns))
        fault = self._health.confirmed(state.fault)
        fault = self._tracking_error.check(t_s, q, self._set_point_rad) or fault
        with self._lock:
            was_free = self._guard.held is None
            self._guard.report_load(t_s, state.load, self._health.temperature_degc)
            if fault is not None:
                self._guard.stop(fault)
            if was_free and self._guard.held is not None:
                self._held_pose_rad = np.clip(q, self._whole.low_rad, self._whole.high_rad)

    def _monitor_health(self, wire: Wire, state: ServoState) -> None:
        if (i := self._health.due(self._rounds)) is None:
            return
        health = self._bus.health(wire, self._ids[i])
        self._health.record(i, health)
        if not health.holds:
            self.stop(state.fault or f"servo {self._ids[i]} has let go, as one does whose supply failed for a moment")

    def _send_set_point(self, wire: Wire) -> None:
        with self._lock:
            if self._mailbox.gas_ns is not None:
                self._guard.heartbeat(seconds(self._mailbox.gas_ns), NOSE)
            if self._clock.suspended_s > MAX_SUSPENDED_S:
                self._guard.stop("the computer was suspended")
            self._set_point_rad = self._guard.set_point(self._now_s()) if self._held_pose_rad is None else self._held_pose_rad
        self._bus.write_goals(wire, self._ids, self._goal_counts())

    def _goal_counts(self) -> Positions:
        return self._homing.counts(self._set_point_rad, self._bus.counts_per_turn)

    def _refuse_outside(self, q: Array) -> None:
        if not self._whole.is_allowed(q):
            degrees = ", ".join(f"{name} {math.degrees(angle):.0f}" for name, angle in zip(self._whole.all_names, q, strict=True))
            home = ", ".join(f"{math.degrees(angle):.0f}" for angle in self._whole.home_rad)
            raise OioError(
                f"the arm stands at {degrees} degrees, nose at {np.round(self._whole.nose(q), 2).tolist()} m, where it may not be. It was "
                f"not switched on. Put it by hand near its home ({home} degrees) and start again; if it stands there, home it anew "
                f"(python -m hardware.home)."
            )
