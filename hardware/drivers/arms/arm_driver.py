"""Driver of an arm: reads the joints and sends guarded set-points about a hundred times a second, in the same cycle."""

import time
from abc import ABC, abstractmethod
from dataclasses import replace
from typing import Generic, TypeVar

from hardware.drivers.arms.control import ArmControl
from hardware.drivers.arms.jitter import Jitter
from hardware.drivers.arms.joint_reading import JointReading
from hardware.drivers.arms.shared_guard import SharedGuard
from hardware.drivers.arms.tracking_error import TrackingErrorMonitor
from hardware.transport.clock import Clock
from hardware.transport.driver import Counts
from hardware.transport.mailbox import Mailbox, StampedSample
from hardware.transport.port import NoAnswer
from oio.core.records import Array, nanoseconds, seconds
from oio.kinematics.finite_differences import FiniteDifferences
from oio.motion.guard_account import GuardAccount

MAX_SLEEP_S = 0.02  # at a time, so that the thread can end
C = TypeVar("C")


class ArmDriver(ABC, Generic[C]):
    """All joints of an arm over a connection C; locked joints are held at home. A driver adds how they are read and written."""

    key = "backend.arm"
    name: str  # value of backend.arm.driver=

    def __init__(self, control: ArmControl, guard: SharedGuard, names: tuple[str, ...], dof: int, mailbox: Mailbox, clock: Clock) -> None:
        self._guard, self._dof, self._mailbox, self._clock = guard, dof, mailbox, clock
        self._period_ns, self._due_ns = nanoseconds(control.period_s), 0
        self._tracking_error = TrackingErrorMonitor(names, control.tracking_error_deg, control.tracking_error_s)
        self._differences, self.jitter, self._rounds, self._lost = FiniteDifferences(), Jitter(), 0, 0

    @abstractmethod
    def configure(self, connection: C) -> str | None:
        """Make the arm hold itself where it is; return what it says of itself. Raises OioError for a pose outside the limits."""

    @abstractmethod
    def counts(self) -> Counts:
        """Link statistics so far."""

    @property
    @abstractmethod
    def health_summary(self) -> str:
        """What the arm said of its health so far, as text."""

    @abstractmethod
    def _read(self, connection: C) -> JointReading: ...

    @abstractmethod
    def _write(self, connection: C, set_point: Array) -> None: ...

    def _after_reading(self, connection: C) -> None:
        """Whatever else is due in a cycle."""

    def poll(self, connection: C) -> bool:
        """Read the joints and send the set-point, once a control period."""
        wait_s = self._clock.host_s(seconds(self._due_ns - self._clock.now_ns()))
        if wait_s > 0:
            time.sleep(min(wait_s, MAX_SLEEP_S))
            return False
        self._due_ns = max(self._due_ns, self._clock.now_ns() - self._period_ns) + self._period_ns
        try:
            asked_ns = self._clock.now_ns()
            reading = self._read(connection)
            arrived_ns = self._clock.now_ns()
            self._report(reading, (asked_ns + arrived_ns) // 2 if reading.t_ns is None else reading.t_ns, arrived_ns)
            self._after_reading(connection)
        except NoAnswer:
            self._lost += 1
            raise
        finally:
            self._send_set_point(connection)
        return True

    def release(self, connection: C) -> None:
        """Stop at the present set-point."""
        if self._guard.begun:
            self._guard.stop("the run is over")
            self._send_set_point(connection)

    def move(self, goal: Array, over_s: float) -> float:
        """Start a move of the unlocked joints to goal (n,) rad; return its duration [s]. Raises what the guard refuses."""
        return self._guard.move(goal, over_s)

    def heartbeat(self) -> None:
        """Heartbeat of the host: it is still asking for samples."""
        self._guard.heartbeat()

    def stop(self, why: str) -> None:
        """Hold the arm permanently."""
        self._guard.stop(why)

    @property
    def distance_from_home_rad(self) -> float:
        """Largest distance of a joint's set-point from home [rad]."""
        return self._guard.distance_from_home_rad

    @property
    def held(self) -> str | None:
        """Reason of a permanent hold; None while the arm may move."""
        return self._guard.held

    def guard_account(self) -> GuardAccount:
        """What the arm was held to so far."""
        return self._guard.account()

    def _report(self, reading: JointReading, t_ns: int, arrived_ns: int) -> None:
        self._rounds += 1
        self.jitter.beat(t_ns)
        t_s = seconds(t_ns)
        if reading.is_plausible:
            self._mailbox.put(StampedSample(self._differences.state(t_ns, reading.q[: self._dof]), arrived_ns))
        fault = self._tracking_error.check(t_s, reading.q, self._guard.set_point) or reading.fault
        self._guard.report(t_s, reading if fault is None else replace(reading, fault=fault))

    def _send_set_point(self, connection: C) -> None:
        self._write(connection, self._guard.next_set_point(self._mailbox.gas_ns))
