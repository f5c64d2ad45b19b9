"""World of a simulated bench: each control tick (20 ms, five physics steps of 4 ms) the plant gets the set-point of the minimum-jerk move,
and due samples are taken.
"""

import contextlib
import copy
from collections import deque
from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated

import mujoco
import numpy as np

from hardware.simulation.plant import Plant
from hardware.simulation.plant_spec import PlantSpec
from hardware.simulation.world_changes import WorldChanges
from oio.core.errors import BadInput
from oio.core.interfaces import Air, SimulatedSensor
from oio.core.records import Array, GasSample, WorldSample, nanoseconds, seconds
from oio.core.seeds import Seeds
from oio.core.settings import Within, settings
from oio.gas.source import Source
from oio.kinematics.arm import Arm
from oio.kinematics.finite_differences import FiniteDifferences
from oio.motion.guard import HOST, NOSE, Guard, SafetyLimits
from oio.motion.guard_account import GuardAccount

OWN = ("hardware", "oio")
IN_TURN, TOGETHER = "in_turn", "together"
LOAD_EVERY = 5  # control ticks: 0.1 s


@settings
class MujocoSim:
    """Configuration of the simulated bench; frozen, `open()` makes it live."""

    arm: Arm
    sensor: SimulatedSensor
    air: Air
    beacon: Source
    source: Source
    world: WorldChanges
    safety: SafetyLimits
    background_ppm: Annotated[float, Within(0, 1e6)]
    emission_ml_s: Annotated[float, Within(0, 1e4)]
    joint_period_s: Annotated[float, Within(0.002, 1)]  # period of the logged joint states
    air_every: Annotated[int, Within(1, 100)]  # control ticks per step of the air
    truth_every: Annotated[int, Within(1, 1000)]  # control ticks per logged truth
    encoder_counts: Annotated[int, Within(16, 1 << 24)]
    gas_delay_s: Annotated[float, Within(0, 10)]  # delay of a reading until it is stamped and sent, rounded up to a control tick
    sampling: str  # of a pair of elements: in_turn, one of them each time; together, both each time
    seeds: Seeds

    def check(self) -> None:
        """Refuse an unknown way of sampling, and a pair where there is none."""
        if self.sampling == TOGETHER and self.sensor.elements == 1:
            given = f"backend.sampling={TOGETHER} was given, but sensor '{self.sensor.name}' has one element"
            raise BadInput(f"{given}: there is no pair to sample. Type a sensor of two, e.g. sensor=ec, or backend.sampling={IN_TURN}.")
        if self.sampling not in (IN_TURN, TOGETHER):
            given = f"backend.sampling is '{self.sampling}'"
            raise BadInput(
                f"{given}, but the elements of a pair are sampled {IN_TURN} or {TOGETHER}. Type e.g. backend.sampling={TOGETHER}."
            )

    @contextlib.contextmanager
    def open(self) -> Iterator["SimulatedWorld"]:
        """Create the plant and its world in simulated time; the arm is held at the end of the context, also after an exception."""
        with self.plant() as plant, _stopped(SimulatedWorld(self, plant)) as world:
            yield world

    @property
    def can_resume(self) -> bool:
        """Whether sensor and air are the project's own: what a plug-in keeps alive (such as a file) may not be copied whole."""
        return all(type(part).__module__.partition(".")[0] in OWN for part in (self.sensor, self.air))

    @contextlib.contextmanager
    def resume(self, world: "SimulatedWorld") -> Iterator["SimulatedWorld"]:
        """Make a copy of a world live, which goes on from there to the last bit as that world would; `world` itself is left as it is."""
        again = copy.deepcopy(world)
        with _warnings_to(again.warned), _stopped(again):
            yield again

    def renewed(self, world: "SimulatedWorld", seeds: Seeds | None) -> "SimulatedWorld":
        """Return a copy of a world, at rest until it is `attended`; `seeds`: with source, turbulence and noise drawn anew from them."""
        again = copy.deepcopy(world)
        if seeds is not None:
            again.renew(seeds)
        return again

    @contextlib.contextmanager
    def attended(self, world: "SimulatedWorld") -> Iterator["SimulatedWorld"]:
        """A world that is at rest in between: it goes on within this context alone, which may be entered again and again."""
        with _warnings_to(world.warned):
            yield world

    @contextlib.contextmanager
    def plant(self) -> Iterator[Plant]:
        """Load the physics, place the sources and switch the sensor on."""
        warned = list[str]()
        with _warnings_to(warned):
            yield Plant(self.plant_spec, warned)

    @property
    def plant_spec(self) -> PlantSpec:
        """Specification of the plant."""
        return PlantSpec(
            arm=self.arm, sensor=self.sensor, air=self.air, beacon=self.beacon, source=self.source, seeds=self.seeds,
            background_ppm=self.background_ppm, emission_ml_s=self.emission_ml_s, period_s=self.joint_period_s, air_every=self.air_every,
            encoder_counts=self.encoder_counts, changes=self.world,
        )  # fmt: skip


@contextlib.contextmanager
def _warnings_to(warned: list[str]) -> Iterator[None]:
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(warned.append)  # else it writes MUJOCO_LOG.TXT; an exception in the callback would abort
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


@contextlib.contextmanager
def _stopped(world: "SimulatedWorld") -> Iterator["SimulatedWorld"]:
    try:
        yield world
    finally:
        world.guard.stop("the run is over")


class SimulatedWorld:
    """Live simulation: a plant in simulated time, which advances while samples are taken."""

    def __init__(self, sim: MujocoSim, plant: Plant) -> None:
        self._sim, self._plant = sim, plant
        self._joints = FiniteDifferences()
        self._sample_ns = self._gas_due_ns = nanoseconds(sim.sensor.sample_s)
        self._element, self._delay_line = 0, deque[GasSample]()  # sampled, not sent yet
        self.guard = Guard(sim.arm, sim.safety, sim.joint_period_s)
        self.guard.begin(sim.arm.home)

    @property
    def warned(self) -> list[str]:
        """Warnings of the physics."""
        return self._plant.warned

    @property
    def mjcf(self) -> str:
        """MJCF of the simulated arm, for the log."""
        return self._plant.mjcf

    @property
    def t_ns(self) -> int:
        """Nanoseconds since the world opened."""
        return self._plant.t_ns

    def guard_account(self) -> GuardAccount:
        """What the arm was held to so far."""
        return self.guard.account()

    def move(self, q_rad: Array, over_s: float) -> float:
        """Start a minimum-jerk move from the present set-point; return its duration [s]. Raises what the guard refuses."""
        return self.guard.move(q_rad, over_s, seconds(self.t_ns))

    def renew(self, seeds: Seeds) -> None:
        """Draw source, turbulence and sensor noise anew: another search on the same bench."""
        self._plant.renew(seeds)

    def present(self, source: str) -> None:
        """Replace the source; the old gas is removed, the new plume is developed."""
        self._plant.present(source)

    def samples(self, for_s: float) -> Iterator[WorldSample]:
        """Run for `for_s`, rounded to whole control ticks, and yield the samples."""
        plant, until_ns = self._plant, self.t_ns + nanoseconds(for_s)
        while plant.t_ns + plant.tick_ns <= until_ns:
            felt = (plant.ticks + 1) % LOAD_EVERY == 0
            plant.tick(self._set_point(seconds(plant.t_ns)), felt)
            if felt:
                self._report_load(seconds(plant.t_ns))
            yield self._joints.state(plant.t_ns, plant.encoders())
            due = plant.t_ns >= self._gas_due_ns
            if due or plant.ticks % self._sim.truth_every == 0:
                yield plant.truth()
            if due:
                self._delay_line.extend(self._sniff())
            while self._delay_line and self._delay_line[0].t_ns + nanoseconds(self._sim.gas_delay_s) <= self.t_ns:
                yield replace(self._delay_line.popleft(), t_ns=self.t_ns)

    def _set_point(self, t_s: float) -> Array:
        self.guard.heartbeat(t_s, HOST)  # time passes only while the host takes samples
        return self.guard.set_point(t_s)

    def _report_load(self, t_s: float) -> None:
        """Report the load to the guard, except at a joint stop, onto which the drift of the paper's encoders (degrees) presses a joint."""
        self.guard.report_load(t_s, np.where(self._plant.at_stop(), np.nan, self._plant.load()))

    def _sniff(self) -> list[GasSample]:
        """The element whose turn it is, or all at once."""
        count = self._sim.sensor.elements
        due = range(count) if self._sim.sampling == TOGETHER else (self._element,)
        samples = [GasSample(self.t_ns, element, self._plant.raw(element)) for element in due]
        self._gas_due_ns += self._sample_ns
        self._element = (self._element + 1) % count
        self.guard.heartbeat(seconds(self.t_ns), NOSE)
        return samples
