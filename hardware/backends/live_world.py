"""World of a live bench: the samples of its devices, merged in time order, in real time."""

import time
from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Any, NamedTuple, TypeVar

import numpy as np

from hardware.backends.link_account import LinkAccount
from hardware.backends.reorder_buffer import ReorderBuffer
from hardware.drivers.arms.arm_driver import ArmDriver
from hardware.drivers.arms.fixed_mount import FixedMount
from hardware.drivers.valves.port import SOURCES, Valve
from hardware.transport.clock import Clock
from hardware.transport.device import Device
from hardware.transport.mailbox import Mailbox, StampedSample
from oio.core import interrupt
from oio.core.errors import BadInput, OioError
from oio.core.records import Array, Event, GasSample, Truth, WorldSample, nanoseconds, seconds
from oio.kinematics.arm import Arm
from oio.motion.guard_account import GuardAccount

A = TypeVar("A")
Place = tuple[float, float, float] | None
SLACK_NS = nanoseconds(0.02)  # a caller within this tolerance counts as in time
LOOK_S = 0.05  # longest wait between two checks
ACCOUNT_NS = nanoseconds(1.0)  # period of the account


class LiveDevices(NamedTuple):
    """Devices at the ports. `arm` is the thread of `mover`; None if the nose is at a fixed position."""

    nose: Device[Any]
    arm: Device[Any] | None
    mover: ArmDriver[Any] | FixedMount
    valve: Valve


class LiveWorld:
    """Live world in real time. Samples that arrived between two calls of `samples` come first. `t_ns` is the end of the last span."""

    def __init__(
        self, devices: LiveDevices, clock: Clock, mailbox: Mailbox, arm: Arm, places_m: Mapping[str, Place], reorder_s: float
    ) -> None:  # fmt: skip
        self._clock, self._mailbox, self._kinematics, self._places_m = clock, mailbox, arm, places_m
        self._buffer = ReorderBuffer(mailbox, clock, reorder_s, LOOK_S)
        self._nose, self._arm, self._mover, self._valve = devices.nose, devices.arm, devices.mover, devices.valve
        self._t_ns, self._open_source, self._last_account_ns = 0, "none", 0
        self._gas_at_ns, self._asked_ns = 0, 0  # when the last byte of the last gas sample came, and when its span was asked for
        self.began_utc = (datetime.now(UTC) - timedelta(seconds=seconds(clock.now_ns()))).isoformat(timespec="microseconds")
        self.account = LinkAccount([d for d in (devices.nose, devices.arm) if d is not None], devices.mover, mailbox)

    @property
    def t_ns(self) -> int:
        """Nanoseconds since the ports were opened."""
        return self._t_ns

    @property
    def identities(self) -> dict[str, str | None]:
        """What nose and arm said of themselves, by configuration key; None for one that said nothing."""
        return {device.driver.key: device.identity for device in (self._nose, self._arm) if device is not None}

    def guard_account(self) -> GuardAccount | None:
        """What the arm was held to so far; None without an arm that moves."""
        return self._mover.guard_account() if isinstance(self._mover, ArmDriver) else None

    def go_home(self, at_least_s: float) -> None:
        """First move, to the home pose; its samples are discarded."""
        arm = self._kinematics
        for sample in self.samples(self._mover.move(arm.home, at_least_s)):
            interrupt.check()
            del sample
        self.account.homed()

    def move(self, q_rad: Array, over_s: float) -> float:
        """Start a smooth move to q_rad (n,) once the arm is connected; return its duration [s]. Raises what the guard refuses."""
        goal, n = np.array(q_rad, dtype=float), self._kinematics.dof
        if goal.shape != (n,) or not np.all(np.isfinite(goal)):
            raise BadInput(f"a move to {goal.tolist()} was asked for, but dof={n} takes {n} finite numbers. Type e.g. {[0.1] * n}.")
        while self._arm is not None and self._arm.lost:  # a lost arm cannot move; its error ends the waiting
            self._check_devices()
            time.sleep(LOOK_S)
        return self._mover.move(goal, over_s)

    def present(self, source: str) -> None:
        """Open one source; samples from before it was open can then be taken by `samples(0)`."""
        if source not in SOURCES:
            raise BadInput(f"present('{source}') was asked for, but a world has {', '.join(SOURCES)}.")
        self._valve.present(source, self._check_devices)  # an operator may take minutes, in which the arm may be held
        self._open_source = source
        self.account.source_opened()
        time.sleep(self._clock.host_s(self._buffer.delay_s))

    def samples(self, for_s: float) -> Iterator[WorldSample]:
        """Yield the samples since the last span and of the next `for_s` [s]. Raises OioError when a device is lost or the arm is held."""
        asked_ns = self._clock.now_ns()
        now_ns = asked_ns - self._buffer.delay_ns  # samples are complete up to this delay behind the host
        until_ns = (self._t_ns if now_ns - self._t_ns < SLACK_NS else now_ns) + nanoseconds(for_s)
        yield from self._events()
        yield from self._truth()
        while (arrived := (yield from self._with_last_account(lambda: self._buffer.next(until_ns, self._check_devices)))) is not None:
            sample = arrived.sample
            if sample.t_ns < self._t_ns:
                self.account.late()
                sample = replace(sample, t_ns=self._t_ns)
            self._t_ns = sample.t_ns
            self.account.delivered(sample)
            if isinstance(sample, GasSample):
                self._gas_at_ns, self._asked_ns = arrived.at_ns, asked_ns
            yield sample
        self._t_ns = max(self._t_ns, until_ns)
        yield from self._events()

    def believed(self) -> None:
        """The last gas sample that was yielded has reached the belief."""
        latency_s = self._clock.host_s(1e-9 * (self._clock.now_ns() - self._gas_at_ns))
        self.account.latency(latency_s, awaited=self._gas_at_ns >= self._asked_ns)

    def _with_last_account(self, action: Callable[[], A]) -> Generator[WorldSample, None, A]:
        """Run an action; if it raises OioError, yield the last account for the log before."""
        try:
            return action()
        except OioError:
            yield Event(self._t_ns, "link", str(self.account))
            raise

    def _check_devices(self) -> None:
        """Raise on a requested stop, a lost device or a held arm; also a source of joint states for a fixed mount."""
        interrupt.check()
        for device in (self._nose, self._arm):
            if device is not None:
                device.check()
        if isinstance(self._mover, FixedMount):
            for state in self._mover.until(self._clock.now_ns()):
                self._mailbox.put(StampedSample(state, state.t_ns))
            return
        self._mover.heartbeat()
        if self._mover.held is not None:
            raise OioError(f"the arm was stopped: {self._mover.held}. What was logged so far can be read.")

    def _truth(self) -> Iterator[Truth]:
        """Position of the open source, if it was measured: for scoring only."""
        place = self._places_m.get(self._open_source)
        if place is not None:
            self._t_ns += 1
            unknown = np.full(3, np.nan)
            yield Truth(self._t_ns, np.full(self._kinematics.dof, np.nan), unknown, np.array(place), float("nan"))

    def _events(self) -> Iterator[WorldSample]:
        for device in (self._nose, self._arm):
            while device is not None and device.news:
                yield Event(self._t_ns, *device.news.pop(0))
        text = yield from self._with_last_account(self._valve.poll)
        if text is not None:
            yield Event(self._t_ns, "gap", text)
        if self._t_ns - self._last_account_ns >= ACCOUNT_NS:
            self._last_account_ns = self._t_ns
            yield Event(self._t_ns, "link", str(self.account))
