"""Driver of an arm of servos on a bus, of any maker."""

from collections import Counter
from collections.abc import Mapping

from hardware.drivers.arms.arm_driver import ArmDriver
from hardware.drivers.arms.joint_reading import JointReading
from hardware.drivers.arms.shared_guard import SharedGuard
from hardware.drivers.servos.bus import Bus, Positions, ServoState
from hardware.drivers.servos.servo_control import ServoControl
from hardware.drivers.servos.servo_health import HealthMonitor
from hardware.transport.clock import Clock
from hardware.transport.driver import Counts
from hardware.transport.mailbox import Mailbox
from hardware.transport.port import NoAnswer, Wire
from oio.core.records import Array
from oio.kinematics.arm import Arm
from oio.kinematics.homing import Homing
from oio.motion.guard import SafetyLimits

ELSEWHERE = "if it stands there, home it anew (python -m hardware.home)"


class ServoArm(ArmDriver[Wire]):
    """Driver of all joints of an arm over a servo bus, ids from 1 at the base."""

    def __init__(self, bus: Bus, control: ServoControl, arm: Arm, safety: SafetyLimits, mailbox: Mailbox, clock: Clock) -> None:
        super().__init__(control, SharedGuard(control, arm, safety, clock, ELSEWHERE), arm.all_names, arm.dof, mailbox, clock)
        self._bus, self.name, self.baud = bus, bus.name, bus.baud
        self._homing = arm.homed or Homing.nominal(len(arm.all_names), bus.middle)
        self._torque_off, self._ids = control.torque_off_at_end, list(range(1, len(arm.all_names) + 1))
        self._health = HealthMonitor(len(self._ids), control.health_every, control.fault_cycles)
        self._fault: str | None = None  # of the last reading, confirmed or not

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
        goals = self._goal_counts(self._guard.set_point)
        for servo, count in zip(self._ids, goals, strict=True):  # writes are not acknowledged; a stale goal makes it jump
            if (goal := self._bus.health(wire, servo).goal) != count:
                raise NoAnswer(f"servo {servo} was given the goal {count}, but has {goal}: see the limits in its memory")
        self._bus.torque(wire, self._ids, True)
        return _described(models)

    def release(self, wire: Wire) -> None:
        """Stop at the present pose; torque stays enabled unless the configuration disables it."""
        super().release(wire)
        if self._guard.begun and self._torque_off:
            self._bus.torque(wire, self._ids, False)

    @property
    def health_summary(self) -> str:
        """Lowest supply voltage and highest temperature read so far, as text."""
        return self._health.summary

    def counts(self) -> Counts:
        """Frames and polling cycles so far."""
        f = self._bus.framer()
        return Counter(good=f.good, corrupt=f.corrupt, skipped=f.skipped, lost=self._lost, rounds=self._rounds)

    def _models(self, wire: Wire) -> dict[int, str | None]:
        return {servo: self._bus.ping(wire, servo) for servo in self._ids}

    def _angles(self, state: ServoState) -> Array:
        return self._homing.angles(state.counts, self._bus.counts_per_turn)

    def _read(self, wire: Wire) -> JointReading:
        state = self._bus.read_state(wire, self._ids)
        self._fault = state.fault
        return JointReading(self._angles(state), state.load, self._health.temperature_degc, self._health.confirmed(state.fault))

    def _write(self, wire: Wire, set_point: Array) -> None:
        self._bus.write_goals(wire, self._ids, self._goal_counts(set_point))

    def _after_reading(self, wire: Wire) -> None:
        """Read the health of one servo, every `health_every` cycles."""
        if (i := self._health.due(self._rounds)) is None:
            return
        health = self._bus.health(wire, self._ids[i])
        self._health.record(i, health)
        if not health.holds:
            self.stop(self._fault or f"servo {self._ids[i]} has let go, as one does whose supply failed for a moment")

    def _goal_counts(self, set_point: Array) -> Positions:
        return self._homing.counts(set_point, self._bus.counts_per_turn)


def _described(models: Mapping[int, str | None]) -> str | None:
    found = [f"{servo} {model}" for servo, model in models.items() if model]
    return f"servos {', '.join(found)}" if found else None
