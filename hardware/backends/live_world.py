"""The live bench: what its devices left in the mailbox, in the order of time, in real time."""

import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple, TypeVar

import numpy as np

from hardware.drivers.servos.fixed_mount import FixedMount
from hardware.drivers.servos.servo_arm import ServoArm
from hardware.drivers.valves.port import SOURCES, Valve
from hardware.transport.clock import Clock
from hardware.transport.device import Device
from hardware.transport.mailbox import Mailbox, StampedSample
from oio.core import interrupt
from oio.core.errors import BadInput, OioError
from oio.core.records import Array, Event, GasSample, Truth, WorldSample, nanoseconds, seconds
from oio.kinematics.arm import Arm

A = TypeVar("A")
Place = tuple[float, float, float] | None
SLACK_NS = nanoseconds(0.02)  # a caller who is so late is not late
LOOK_S = 0.05  # the longest wait before it looks again
ACCOUNT_NS = nanoseconds(1.0)  # the account is told not more often
KEPT = 10_000  # delays from the last byte to the belief


class LiveDevices(NamedTuple):
    """What is at the ports. `arm` is the thread of `mover`; None if the nose stands at a fixed place."""

    nose: Device
    arm: Device | None
    mover: ServoArm | FixedMount
    valve: Valve


class LiveWorld:
    """Time goes on while nobody asks for samples: what was sensed meanwhile comes first. `t_ns` is the end of the last span."""

    def __init__(
        self, devices: LiveDevices, clock: Clock, mailbox: Mailbox, arm: Arm, places_m: Mapping[str, Place], hold_s: float
    ) -> None:  # fmt: skip
        self._clock, self._mailbox, self._kinematics, self._places_m, self._hold_s = clock, mailbox, arm, places_m, hold_s
        self._nose, self._arm, self._mover, self._valve = devices.nose, devices.arm, devices.mover, devices.valve
        self._t_ns, self._open, self._late, self._told_ns = 0, "none", 0, 0
        self._taken = {"gas": 0, "joints": 0}
        self._homeward = dict(self._taken)
        self._delays_s = deque[float](maxlen=KEPT)  # since a source was opened

    @property
    def t_ns(self) -> int:
        """Nanoseconds since the ports were opened."""
        return self._t_ns

    def go_home(self, at_least_s: float) -> None:
        """The first move; what is sensed meanwhile is nobody's."""
        arm = self._kinematics
        for sample in self.samples(self._mover.move(arm.home, at_least_s)):
            interrupt.check()
            del sample
        self._homeward, self._taken = self._taken, {"gas": 0, "joints": 0}

    def move(self, q_rad: Array, over_s: float) -> float:
        """Begin a smooth move to q_rad (n,), when the arm is there. Raises what the guard refuses."""
        goal, n = np.array(q_rad, dtype=float), self._kinematics.dof
        if goal.shape != (n,) or not np.all(np.isfinite(goal)):
            raise BadInput(f"a move to {goal.tolist()} was asked for, but dof={n} takes {n} finite numbers. Type e.g. {[0.1] * n}.")
        while self._arm is not None and self._arm.lost:  # nobody would go there; its error ends the waiting
            self._watch()
            time.sleep(LOOK_S)
        return self._mover.move(goal, over_s)

    def present(self, source: str) -> None:
        """Open one source; samples that were sensed before it was open can be had by `samples(0)` then."""
        if source not in SOURCES:
            raise BadInput(f"present('{source}') was asked for, but a world has {', '.join(SOURCES)}.")
        self._valve.present(source, self._watch)  # a person may take minutes, in which the arm may be held
        self._open = source
        self._delays_s.clear()
        time.sleep(self._clock.host_s(self._hold_s))

    def samples(self, for_s: float) -> Iterator[WorldSample]:
        """What was sensed since the last span and in the next `for_s` seconds. Raises OioError when a device is gone or the arm is held."""
        now_ns = self._clock.now_ns() - nanoseconds(self._hold_s)  # so far behind the host its samples are complete
        until_ns = (self._t_ns if now_ns - self._t_ns < SLACK_NS else now_ns) + nanoseconds(for_s)
        yield from self._news()
        yield from self._truth()
        while (arrived := (yield from self._or_last_account(lambda: self._next(until_ns)))) is not None:
            sample = arrived.sample
            if sample.t_ns < self._t_ns:
                self._late += 1
                sample = replace(sample, t_ns=self._t_ns)
            self._t_ns = sample.t_ns
            self._taken["gas" if isinstance(sample, GasSample) else "joints"] += 1
            yield sample
            if isinstance(sample, GasSample):
                self._delays_s.append(self._clock.host_s(1e-9 * (self._clock.now_ns() - arrived.at_ns)))
        self._t_ns = max(self._t_ns, until_ns)
        yield from self._news()

    def _or_last_account(self, action: Callable[[], A]) -> Generator[WorldSample, None, A]:
        """The action; if it is the end of all, the last account goes to the log before."""
        try:
            return action()
        except OioError:
            yield Event(self._t_ns, "link", self.account())
            raise

    def _next(self, until_ns: int) -> StampedSample | None:
        """The next sample of the span, when it is sure that none before it will come; None at its end."""
        hold_ns = nanoseconds(self._hold_s)
        while True:
            self._watch()
            with self._mailbox.news:
                now_ns = self._clock.now_ns()
                queue, due_ns = self._first(hold_ns)
                if queue and queue[0].sample.t_ns <= until_ns and due_ns <= now_ns:
                    return queue.popleft()
                if now_ns >= until_ns + hold_ns and (not queue or queue[0].sample.t_ns > until_ns):
                    return None
                wake_ns = min(due_ns, until_ns + hold_ns) if queue and queue[0].sample.t_ns <= until_ns else until_ns + hold_ns
                self._mailbox.news.wait(min(max(self._clock.host_s(1e-9 * (wake_ns - now_ns)), 0.0), LOOK_S))

    def _first(self, hold_ns: int) -> tuple[deque[StampedSample], int]:
        """The queue whose head comes first, and when that may be given away [ns]: gas at once, joints when no older gas can come."""
        gas, joints = self._mailbox.gas, self._mailbox.joints
        if gas and (not joints or gas[0].sample.t_ns <= joints[0].sample.t_ns):
            return gas, 0
        sure = gas or not joints or joints[0].sample.t_ns < self._mailbox.gas_from_ns
        return joints, 0 if sure else joints[0].sample.t_ns + hold_ns

    def _watch(self) -> None:
        """A stop that was asked for, devices that are gone, an arm that is held."""
        interrupt.check()
        for device in (self._nose, self._arm):
            if device is not None and device.error is not None:
                raise device.error
        if isinstance(self._mover, FixedMount):
            for state in self._mover.until(self._clock.now_ns()):
                self._mailbox.put(StampedSample(state, state.t_ns))
            return
        self._mover.alive()
        if self._mover.held is not None:
            raise OioError(f"the arm was stopped: {self._mover.held}. What was logged so far can be read.")

    def _truth(self) -> Iterator[Truth]:
        """Where the open source stands, if somebody measured it: for scoring only."""
        place = self._places_m.get(self._open)
        if place is not None:
            self._t_ns += 1
            unknown = np.full(3, np.nan)
            yield Truth(self._t_ns, np.full(self._kinematics.dof, np.nan), unknown, np.array(place), float("nan"))

    def _news(self) -> Iterator[WorldSample]:
        for device in (self._nose, self._arm):
            while device is not None and device.news:
                yield Event(self._t_ns, *device.news.pop(0))
        said = yield from self._or_last_account(self._valve.watch)
        if said is not None:
            yield Event(self._t_ns, "gap", said)
        if self._t_ns - self._told_ns >= ACCOUNT_NS:
            self._told_ns = self._t_ns
            yield Event(self._t_ns, "link", self.account())

    def account(self) -> str:
        """Every frame and sample so far, how even the joints come, and how long a sniff takes from its last byte to the belief."""
        parts = [_of(device) for device in (self._nose, self._arm) if device is not None]
        if isinstance(self._mover, ServoArm):
            parts.append(f"joints {self._mover.rhythm}, {self._mover.supply}")
        taken, homeward, waiting = self._taken, self._homeward, (len(self._mailbox.gas), len(self._mailbox.joints))
        parts.append(f"taken {taken['gas']} gas {taken['joints']} joints, waiting {waiting[0]} and {waiting[1]}")
        parts.append(f"on the first way home {homeward['gas']} and {homeward['joints']}")
        parts.append(f"late {self._late}, overflown {self._mailbox.lost}")
        if self._delays_s:
            ms = 1e3 * np.quantile(np.array(self._delays_s), (0.5, 0.95))
            parts.append(f"last byte to belief {ms[0]:.2f} ms median, {ms[1]:.2f} ms 95 %")
        return "; ".join(parts)


def _of(device: Device) -> str:
    counts = ", ".join(f"{key} {value}" for key, value in sorted(device.driver.counts().items()))
    return f"{device.driver.key} {device.driver.name}: {counts}, opened anew {device.reconnects}, away {seconds(device.away_ns):.1f} s"
