"""Servo arm driver: reads the joints and sends guarded set-points about a hundred times a second, in the same cycle."""

import time
from collections import Counter
from collections.abc import Mapping

from hardware.drivers.servos.bus import Positions, ServoState
from hardware.drivers.servos.jitter import Jitter
from hardware.drivers.servos.port import ArmPort
from hardware.drivers.servos.servo_health import HealthMonitor
from hardware.drivers.servos.shared_guard import SharedGuard
from hardware.drivers.servos.tracking_error import TrackingErrorMonitor
from hardware.transport.clock import Clock
from hardware.transport.driver import Counts
from hardware.transport.mailbox import Mailbox, StampedSample
from hardware.transport.port import NoAnswer, Wire
from oio.core.records import Array, nanoseconds, seconds
from oio.kinematics.arm import Arm
from oio.kinematics.finite_differences import FiniteDifferences
from oio.kinematics.homing import Homing
from oio.motion.guard import SafetyLimits
from oio.motion.guard_account import GuardAccount

MAX_SLEEP_S = 0.02  # at a time, so that the thread can end


class ServoArm:
    """Driver of all joints of an arm; locked joints are held at home."""

    key = "backend.arm"

    def __init__(self, port: ArmPort, arm: Arm, safety: SafetyLimits, mailbox: Mailbox, clock: Clock) -> None:
        self._bus, self._dof, self._guard = (bus := port.bus()), arm.dof, SharedGuard(port, arm, safety, clock)
        self._homing = arm.homed or Homing.nominal(len(arm.all_names), bus.middle)
        self._mailbox, self._clock = mailbox, clock
        self._period_ns, self._torque_off = nanoseconds(port.period_s), port.torque_off_at_end
        self._tracking_error = TrackingErrorMonitor(arm.all_names, port.tracking_error_deg, port.tracking_error_s)
        self.name, self.baud = bus.name, bus.baud
        self._ids = list(range(1, len(arm.all_names) + 1))
        self._differences, self.jitter, self._rounds, self._due_ns, self._lost = FiniteDifferences(), Jitter(), 0, 0, 0
        self._health = HealthMonitor(len(self._ids), port.health_every, port.fault_cycles)

    def identify(self, wire: Wire) -> str | None:
        """Return the models of the servos that answer."""
        return _described(self._models(wire))

    def configure(self, wire: Wire) -> str | None:
        """Enable torque at the present pose. Raises OioError outside the limits: no safe path from there is known."""
        models = self._models(wire)
        missing = [servo for servo, model in models.items() if model is None]
        if missing:
            raise NoAnswer(f"servo {missing[0]} of {len(self._ids)} does not answer")
        self._bus.configure(wire, self._ids)
        self._guard.connect(self._angles(self._bus.read_state(wire, self._ids)))
        self._send_set_point(wire)
        for servo, count in zip(self._ids, self._goal_counts(), strict=True):  # writes are not acknowledged; a stale goal makes it jump
            if (goal := self._bus.health(wire, servo).goal) != count:
                raise NoAnswer(f"servo {servo} was given the goal {count}, but has {goal}: see the limits in its memory")
        self._bus.torque(wire, self._ids, True)
        return _described(models)

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
        if not self._guard.begun:
            return
        self._guard.stop("the run is over")
        self._send_set_point(wire)
        if self._torque_off:
            self._bus.torque(wire, self._ids, False)

    def move(self, goal: Array, over_s: float) -> float:
        """Start a move of the unlocked joints to goal (n,) rad; return its duration [s]. Raises what the guard refuses."""
        return self._guard.move(goal, over_s)

    def heartbeat(self) -> None:
        """Heartbeat of the host: it is still asking for samples."""
        self._guard.heartbeat()

    @property
    def distance_from_home_rad(self) -> float:
        """Largest distance of a joint's set-point from home [rad]."""
        return self._guard.distance_from_home_rad

    def stop(self, why: str) -> None:
        """Hold the arm permanently."""
        self._guard.stop(why)

    @property
    def health_summary(self) -> str:
        """Lowest supply voltage and highest temperature read so far, as text."""
        return self._health.summary

    def guard_account(self) -> GuardAccount:
        """What the arm was held to so far."""
        return self._guard.account()

    @property
    def held(self) -> str | None:
        """Reason of a permanent hold; None while the arm may move."""
        return self._guard.held

    def counts(self) -> Counts:
        """Frames and polling cycles so far."""
        f = self._bus.framer()
        return Counter(good=f.good, corrupt=f.corrupt, skipped=f.skipped, lost=self._lost, rounds=self._rounds)

    def _models(self, wire: Wire) -> dict[int, str | None]:
        return {servo: self._bus.ping(wire, servo) for servo in self._ids}

    def _angles(self, state: ServoState) -> Array:
        return self._homing.angles(state.counts, self._bus.counts_per_turn)

    def _report(self, state: ServoState, t_ns: int, arrived_ns: int) -> None:
        self._rounds += 1
        self.jitter.beat(t_ns)
        q, t_s = self._angles(state), seconds(t_ns)
        self._mailbox.put(StampedSample(self._differences.state(t_ns, q[: self._dof]), arrived_ns))
        fault = self._health.confirmed(state.fault)
        fault = self._tracking_error.check(t_s, q, self._guard.set_point) or fault
        self._guard.report(t_s, q, state.load, self._health.temperature_degc, fault)

    def _monitor_health(self, wire: Wire, state: ServoState) -> None:
        if (i := self._health.due(self._rounds)) is None:
            return
        health = self._bus.health(wire, self._ids[i])
        self._health.record(i, health)
        if not health.holds:
            self.stop(state.fault or f"servo {self._ids[i]} has let go, as one does whose supply failed for a moment")

    def _send_set_point(self, wire: Wire) -> None:
        self._guard.next_set_point(self._mailbox.gas_ns)
        self._bus.write_goals(wire, self._ids, self._goal_counts())

    def _goal_counts(self) -> Positions:
        return self._homing.counts(self._guard.set_point, self._bus.counts_per_turn)


def _described(models: Mapping[int, str | None]) -> str | None:
    found = [f"{servo} {model}" for servo, model in models.items() if model]
    return f"servos {', '.join(found)}" if found else None
