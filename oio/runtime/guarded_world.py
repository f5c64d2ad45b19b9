"""The world as stages see it: every sample is logged before a stage sees it, every command is checked before the arm does."""

import copy
import math
from collections.abc import Callable, Iterator

import numpy as np

from oio.core import interrupt
from oio.core.interfaces import World
from oio.core.records import Array, Event, GasSample, JointState, Sample, WorldSample
from oio.kinematics.arm import Arm
from oio.log import RunLog
from oio.motion.guard_account import GuardAccount
from oio.motion.path_planning import duration_s, plan
from oio.runtime.gas_stream import GasStream, StreamGaps

GUARD = "guard"  # kind of an event: the account of the arm's guard


class GuardedWorld:
    """A world that is logged and checked: every sample reaches the log before a stage sees it, every command is checked before the log.

    Ground truth goes to the log only; no stage can see it here. Nor can a stage see gas at the sensor's upper rail (`highest_raw`): a fit
    that took it for a value would put the source where the gas is just that strong.
    """

    def __init__(
        self, world: World, arm: Arm, log: RunLog, highest_raw: float = math.inf, display: Callable[[JointState], None] | None = None
    ) -> None:
        self._world, self._arm, self._log, self._highest_raw = world, arm, log, highest_raw
        self._display = display  # of the joints, for viewers
        self._goal, self._gas = arm.home, GasStream()
        self.sensor_serial: str | None = None  # of the sensor, where a person has told it in the run
        self._planned: tuple[Array, float] | None = None  # the goal last planned from here, and its duration [s]

    @property
    def t_ns(self) -> int:
        """Nanoseconds since the world opened."""
        return self._world.t_ns

    def samples(self, for_s: float) -> Iterator[Sample]:
        """Let `for_s` seconds pass; yield joint states and gas samples in time order."""
        # the start of every span is logged: worlds end a span on their own ticks, and a replay must end it at the same sample
        self._log.write(Event(self.t_ns, "span", repr(float(for_s))))
        for sample in self._world.samples(for_s):
            self._log.write(sample)
            interrupt.check()
            self._note(sample)
            if self._display is not None and isinstance(sample, JointState):
                self._display(sample)
            if isinstance(sample, GasSample) and sample.raw >= self._highest_raw:
                continue
            if isinstance(sample, JointState | GasSample):
                yield sample

    def _note(self, sample: WorldSample) -> None:
        if isinstance(sample, GasSample):
            self._gas.arrived(sample.t_ns)
        elif isinstance(sample, JointState):
            self._gas.joints_arrived(sample.t_ns)

    def move(self, q_rad: Array) -> float:
        """Begin a smooth move to q_rad (n,); returns its duration [s]. Raises BadInput for a goal outside limits or without a path."""
        goal = self._arm.validated(q_rad)
        over_s = self.move_s(goal)
        self._log.write(Event(self.t_ns, "move", move_text(goal, over_s)))
        self._goal, self._planned = goal, None
        return self._world.move(goal, over_s)

    def move_s(self, q_rad: Array) -> float:
        """Duration [s] of a move to q_rad (n,). Raises BadInput if no path keeps the nose in its box.

        The last one is remembered, so that a stage which asks and then moves has it planned once. The guard of the world plans again,
        from its own set-point.
        """
        if self._planned is None or not np.array_equal(self._planned[0], q_rad):
            self._planned = np.array(q_rad), duration_s(plan(self._arm, self._goal, q_rad))
        return self._planned[1]

    def present(self, source: str) -> None:
        """Open one gas source: `none`, `beacon` or `source`. Samples from before it was open go to the log and to no stage."""
        self._log.write(Event(self.t_ns, "present", source))
        self._world.present(source)
        for _ in self.samples(0.0):  # a real world has gone on meanwhile
            pass

    def attend(self, is_done: Callable[[], bool]) -> None:
        """Wait for a person: a live world goes on meanwhile, and is logged; a simulated or recorded one stands still.

        All of it is one span, however long it lasts: a replay waits for nobody, and must find the same spans.
        """
        self._log.write(Event(self.t_ns, "span", repr(0.0)))
        done = False
        while not done:
            done = is_done()
            interrupt.check()
            for sample in self._world.samples(0.0):
                self._log.write(sample)
                self._note(sample)

    def resume(self, goal: Array, gas: GasStream) -> None:
        """Go on with an arm that was commanded to `goal` (n,) rad before, and after these gas samples."""
        self._goal, self._planned, self._gas = goal, None, copy.deepcopy(gas)

    @property
    def made(self) -> dict[str, object]:
        """When and on which devices: see `made_of`."""
        return made_of(self._world)

    @property
    def gas(self) -> GasStream:
        """The stream of gas samples so far, those at the upper rail among them."""
        return self._gas

    def gaps(self) -> StreamGaps:
        """Gaps in the stream of gas samples so far."""
        return self._gas.gaps()

    def believed(self) -> None:
        """Tell the world that the last gas sample has reached the belief: a live one accounts for how long that took."""
        tell: Callable[[], None] | None = getattr(self._world, "believed", None)
        if tell is not None:
            tell()

    def guard_account(self) -> GuardAccount | None:
        """What the guard of the arm held it to so far, for the log too; None of a world without an arm that moves."""
        asked: Callable[[], GuardAccount | None] | None = getattr(self._world, "guard_account", None)
        account = None if asked is None else asked()
        if account is not None:
            self._log.write(Event(self.t_ns, GUARD, account.to_json()))
        return account

    @property
    def goal(self) -> Array:
        """The joints (n,) rad of the last command."""
        return self._goal


def made_of(world: World) -> dict[str, object]:
    """When a world began (UTC; None of a simulation, which has no date), and what its devices said of themselves."""
    return {"started": getattr(world, "began_utc", None), "devices": dict(getattr(world, "identities", {}))}


def move_text(goal: Array, over_s: float) -> str:
    """A command as text in the log, with which a replay compares its own commands."""
    return f"{float(over_s)!r} s to {np.round(goal, 4).tolist()}"
