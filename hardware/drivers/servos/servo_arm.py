"""An arm of servos: asked where it is a hundred times a second, and led along guarded set-points in the same breath."""

import math
import threading
import time
from collections import Counter

import numpy as np

from hardware.drivers.servos.bus import Positions, ServoState
from hardware.drivers.servos.finite_differences import FiniteDifferences
from hardware.drivers.servos.jitter import Jitter
from hardware.drivers.servos.port import ArmPort
from hardware.drivers.servos.tracking_error import TrackingErrorMonitor
from hardware.transport.clock import Clock
from hardware.transport.device import Counts
from hardware.transport.mailbox import Mailbox, StampedSample
from hardware.transport.port import NoAnswer, Wire
from oio.core.errors import OioError
from oio.core.records import Array, nanoseconds, seconds
from oio.gas.source import unlocked
from oio.kinematics.arm import Arm
from oio.kinematics.homing import Homing
from oio.motion.guard import HOST, NOSE, Guard, SafetyLimits

MAX_SLEEP_S = 0.02  # at a time, so that the thread can end
HEALTH_EVERY = 20  # rounds; of one servo after the other
MOVED_BY_HAND_RAD = math.radians(5.0)  # an arm that comes back so far from where it was held was moved by hand
COMPLAINTS = 20  # rounds in a row with a complaint: then it is believed
MAX_SUSPENDED_S = 1.0  # a host that was suspended for longer does not know what happened meanwhile


class ServoArm:
    """All joints, locked ones too: they are held at home."""

    key = "backend.arm"

    def __init__(self, port: ArmPort, arm: Arm, safety: SafetyLimits, mailbox: Mailbox, clock: Clock) -> None:
        self._bus, self._arm, self._all = (bus := port.bus()), arm, unlocked(arm)
        self._homing = arm.homed or Homing.nominal(len(arm.all_names), bus.middle)
        self._mailbox, self._clock, self._period_ns, self._release = mailbox, clock, nanoseconds(port.period_s), port.release
        self._astray = TrackingErrorMonitor(arm.all_names, port.tracking_error_deg, port.tracking_error_s)
        self.name, self.baud = bus.name, bus.baud
        self._ids = list(range(1, len(arm.all_names) + 1))
        self._locked = np.array(arm.home_rad[arm.dof :])
        self._lock, self._guard = threading.Lock(), Guard(self._all, safety, port.period_s, arm.dof)
        self._differences, self.rhythm, self._rounds, self._begun = FiniteDifferences(), Jitter(), 0, False
        self._temperature, self._due_ns, self._lost, self._led = np.full(len(self._ids), np.nan), 0, 0, self._all.home
        self._volts = np.full(len(self._ids), np.nan)
        self._complaints = 0
        self._rests: Array | None = None  # where it holds itself after it met something: it does not go on pressing

    def knock(self, wire: Wire) -> str | None:
        """Models of the servos that answer."""
        models = {servo: self._bus.ping(wire, servo) for servo in self._ids}
        there = [f"{servo} {model}" for servo, model in models.items() if model]
        return f"servos {', '.join(there)}" if there else None

    def begin(self, wire: Wire) -> None:
        """Hold where it stands. Raises OioError if it stands where it may not be: no one knows a safe way from there."""
        missing = [servo for servo in self._ids if self._bus.ping(wire, servo) is None]
        if missing:
            raise NoAnswer(f"servo {missing[0]} of {len(self._ids)} does not answer")
        self._bus.begin(wire, self._ids)
        q = self._angles(self._bus.feel(wire, self._ids))
        with self._lock:
            for who in (HOST, NOSE):  # it was the arm that was away
                self._guard.alive(self._now_s(), who)
            strayed = np.max(np.abs(q - self._guard.set_point(self._now_s()))) > MOVED_BY_HAND_RAD
            if strayed or not self._begun:
                self._refuse_outside(q)
            if not self._begun or (strayed and self._guard.held is None):
                self._guard.begin(q)
                self._begun = True
            elif strayed:
                self._rests = q  # what is held stays held, but where it is now
        self._lead(wire)
        for servo, count in zip(self._ids, self._goals(), strict=True):  # nobody has said that it came, and an old goal would make it jump
            if (goal := self._bus.health(wire, servo).goal) != count:
                raise NoAnswer(f"servo {servo} was given the goal {count}, but has {goal}: see the limits in its memory")
        self._bus.torque(wire, self._ids, True)

    def turn(self, wire: Wire) -> bool:
        """Where it is, where it shall go; now and then how hot it is."""
        wait_s = self._clock.host_s(seconds(self._due_ns - self._clock.now_ns()))
        if wait_s > 0:
            time.sleep(min(wait_s, MAX_SLEEP_S))
            return False
        self._due_ns = max(self._due_ns, self._clock.now_ns() - self._period_ns) + self._period_ns
        try:
            asked_ns = self._clock.now_ns()
            felt = self._bus.feel(wire, self._ids)
            arrived_ns = self._clock.now_ns()
            self._tell(felt, (asked_ns + arrived_ns) // 2, arrived_ns)
            self._look_after(wire, felt)
        except NoAnswer:
            self._lost += 1
            raise
        finally:
            self._lead(wire)
        return True

    def end(self, wire: Wire) -> None:
        """Stop where it is; it holds itself there unless it was asked to let go."""
        if not self._begun:
            return
        with self._lock:
            self._guard.stop("the run is over")
        self._lead(wire)
        if self._release:
            self._bus.torque(wire, self._ids, False)

    def move(self, goal: Array, over_s: float) -> float:
        """Begin a move of the unlocked joints to goal (n,) rad; seconds it takes. Raises what the guard refuses."""
        with self._lock:
            return self._guard.move(np.concatenate([goal, self._locked]), over_s, self._now_s())

    def alive(self) -> None:
        """The host asks for samples."""
        with self._lock:
            self._guard.alive(self._now_s(), HOST)

    @property
    def from_home_rad(self) -> float:
        """How far the farthest joint stands from home."""
        with self._lock:
            return float(np.max(np.abs(self._guard.set_point(self._now_s()) - self._all.home)))

    def stop(self, why: str) -> None:
        """Hold, for good."""
        with self._lock:
            self._guard.stop(why)

    @property
    def supply(self) -> str:
        """The lowest voltage and the highest temperature of those that were asked."""
        if np.all(np.isnan(self._volts)):
            return "not asked yet"
        return f"{np.nanmin(self._volts):.1f} V, {np.nanmax(self._temperature):.0f} degC"

    @property
    def held(self) -> str | None:
        """Why it stands still for good, if it does."""
        with self._lock:
            return self._guard.held

    def counts(self) -> Counts:
        """Frames so far."""
        f = self._bus.framer()
        return Counter(good=f.good, corrupt=f.corrupt, skipped=f.skipped, lost=self._lost, rounds=self._rounds)

    def _now_s(self) -> float:
        return seconds(self._clock.now_ns())

    def _angles(self, felt: ServoState) -> Array:
        return self._homing.angles(felt.counts, self._bus.counts_per_turn)

    def _tell(self, felt: ServoState, t_ns: int, arrived_ns: int) -> None:
        self._rounds += 1
        self.rhythm.beat(t_ns)
        q, t_s = self._angles(felt), seconds(t_ns)
        self._mailbox.put(StampedSample(self._differences.state(t_ns, q[: self._arm.dof]), arrived_ns))
        self._complaints = self._complaints + 1 if felt.complaint else 0
        complaint = felt.complaint if self._complaints > COMPLAINTS else None
        met = self._astray.feel(t_s, q, self._led) or complaint
        with self._lock:
            went = self._guard.held is None
            self._guard.feel(t_s, felt.load, self._temperature)
            if met is not None:
                self._guard.stop(met)
            if went and self._guard.held is not None:
                self._rests = np.clip(q, self._all.low_rad, self._all.high_rad)

    def _look_after(self, wire: Wire, felt: ServoState) -> None:
        if self._rounds % HEALTH_EVERY == 0:
            i = (self._rounds // HEALTH_EVERY) % len(self._ids)
            health = self._bus.health(wire, self._ids[i])
            self._temperature[i], self._volts[i] = health.temperature_degc, health.voltage
            if not health.holds:
                self.stop(felt.complaint or f"servo {self._ids[i]} has let go, as one does whose supply failed for a moment")

    def _lead(self, wire: Wire) -> None:
        with self._lock:
            if self._mailbox.gas_ns is not None:
                self._guard.alive(seconds(self._mailbox.gas_ns), NOSE)
            if self._clock.slept_s > MAX_SUSPENDED_S:
                self._guard.stop("the computer was suspended")
            self._led = self._guard.set_point(self._now_s()) if self._rests is None else self._rests
        self._bus.goals(wire, self._ids, self._goals())

    def _goals(self) -> Positions:
        return self._homing.counts(self._led, self._bus.counts_per_turn)

    def _refuse_outside(self, q: Array) -> None:
        if not self._all.inside(q):
            degrees = ", ".join(f"{name} {math.degrees(angle):.0f}" for name, angle in zip(self._all.all_names, q, strict=True))
            home = ", ".join(f"{math.degrees(angle):.0f}" for angle in self._all.home_rad)
            raise OioError(
                f"the arm stands at {degrees} degrees, nose at {np.round(self._all.nose(q), 2).tolist()} m, where it may not be. It was "
                f"not switched on. Put it by hand near its home ({home} degrees) and start again; if it stands there, home it anew "
                f"(python -m hardware.home)."
            )
