"""A simulated bench: MuJoCo moves the arm, puffs carry the gas, a specimen of the sensor smells it.

Each control tick (20 ms, five physics steps of 4 ms): servos get the set-point of the minimum-jerk move, seen through their drifting
encoders; the arm moves; the air moves; the sensor is exposed; what is due is sampled.
"""

import contextlib
import math
from collections import deque
from collections.abc import Iterator
from dataclasses import replace

import mujoco
import numpy as np

from oio.arm import Arm, smooth
from oio.errors import BadInput, OioError
from oio.places import Source
from oio.protocols import Air, Sensor
from oio.records import Array, GasSample, JointState, Truth, WorldSample, nanoseconds, seconds
from oio.seeds import Seeds
from oio.settings import in_range, settings


@settings
class MujocoSim:
    """Everything the simulated bench is made of; frozen, `open()` makes it live."""

    arm: Arm
    sensor: Sensor
    air: Air
    beacon: Source
    source: Source
    background_ppm: float
    emission_ml_s: float
    joint_period_s: float  # joints are logged this often
    air_every: int  # the air moves once in so many control ticks
    truth_every: int  # the truth is logged once in so many control ticks
    encoder_counts: int
    gas_delay_s: float  # a reading is stamped and sent so long after it was taken, rounded up to a control tick
    seeds: Seeds

    def check(self) -> None:
        """Refuse periods that the physics cannot honour."""
        in_range(self, joint_period_s=(0.002, 1.0), air_every=(1, 100), truth_every=(1, 1000), encoder_counts=(16, 1 << 24))
        in_range(self, gas_delay_s=(0, 10))
        in_range(self, emission_ml_s=(0, 1e4), background_ppm=(0, 1e6))

    @contextlib.contextmanager
    def open(self) -> Iterator["Bench"]:
        """Load the physics, place the sources, switch the sensor on."""
        warned, before = list[str](), mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(warned.append)  # else it writes MUJOCO_LOG.TXT; raising in there would end the process
        try:
            yield Bench(self, warned)
        finally:
            mujoco.set_mju_user_warning(before)

    def model(self) -> tuple[mujoco.MjModel, str]:
        """The MJCF compiled with a free-play joint beside every unlocked one, and its XML for the log."""
        spec = mujoco.MjSpec.from_file(str(self.arm.path))
        half = math.radians(self.arm.backlash_deg) / 2
        for body in spec.bodies:
            for joint in list(body.joints):
                if half > 0 and joint.name in self.arm.names and joint.type == mujoco.mjtJoint.mjJNT_HINGE:
                    body.add_joint(
                        name=f"{joint.name}_play", axis=joint.axis, range=[-half, half], limited=True,
                        damping=[0.01, 0, 0], armature=0.002, frictionloss=0.0,
                    )  # fmt: skip
        return spec.compile(), spec.to_xml()


class Bench:
    """The live simulation. Time is counted in control ticks, so it never drifts. `warned` is where MuJoCo's warnings come in."""

    _SAG_S = 1.0  # to sag into the servos and the free play

    def __init__(self, sim: MujocoSim, warned: list[str]) -> None:
        self._sim, self._ticks, self._warned = sim, 0, warned
        self._model, self.mjcf = sim.model()
        self._data = mujoco.MjData(self._model)
        self._tick_ns, self._sample_ns = nanoseconds(sim.joint_period_s), nanoseconds(sim.sensor.sample_s)
        self._substeps = round(sim.joint_period_s / self._model.opt.timestep)
        if not math.isclose(self._substeps * self._model.opt.timestep, sim.joint_period_s):
            raise BadInput(
                f"backend.joint_period_s is {sim.joint_period_s}, but it must be a multiple of the MJCF's {self._model.opt.timestep} s."
            )
        truth, n = sim.seeds, sim.arm.dof
        accel = math.radians(sim.arm.encoder_drift_deg_s2) * truth.rng("truth", "drift").uniform(-1, 1, n)
        homing = math.radians(sim.arm.homing_offset_deg) * truth.rng("truth", "homing").standard_normal(n)
        self._encoders = _Encoders(accel, homing, 2 * math.pi / sim.encoder_counts, sim.joint_period_s)
        self._specimen = sim.sensor.unit(truth.rng("truth", "specimen"), truth.rng("measurement", "sensor"))
        self._air = sim.air.open(truth.rng("truth", "air"), truth.rng("disturbance", "air"))
        self._places = {
            "none": None,
            "beacon": sim.beacon.placed("beacon", sim.arm, truth.rng("truth", "beacon")),
            "source": sim.source.placed("source", sim.arm, truth.rng("truth", "source")),
        }
        self._strengths = {
            "none": 0.0,
            "beacon": sim.beacon.strength_drawn(truth.rng("truth", "beacon strength")),
            "source": sim.source.strength_drawn(truth.rng("truth", "source strength")),
        }
        self._open: str = "none"
        self._from, self._way = sim.arm.home, np.zeros(n)
        self._began_s, self._over_s = 0.0, 0.1
        self._gas_due_ns, self._element, self._ppm = self._sample_ns, 0, sim.background_ppm
        self._wire = deque[GasSample]()  # taken, not sent yet
        self._joints = np.array([self._model.joint(name).qposadr[0] for name in sim.arm.names])
        self._servos = np.array([self._model.actuator(name).id for name in sim.arm.names])
        self._nose_m, self._angles, self._ctrl = self._data.site("nose").xpos, self._data.qpos, self._data.ctrl  # views of the live data
        self._stand_still()

    def _stand_still(self) -> None:
        for name, home in zip(self._sim.arm.all_names, self._sim.arm.home_rad, strict=True):
            self._data.joint(name).qpos = home
            self._data.actuator(name).ctrl = home
        self._step(round(self._SAG_S / self._model.opt.timestep))
        self._data.time = 0.0

    def _step(self, count: int) -> None:
        mujoco.mj_step(self._model, self._data, nstep=count)
        if self._warned:  # MuJoCo itself would go on, after bad numbers from the pose of the MJCF
            raise OioError(
                f"the physics of {self._sim.arm.mjcf} broke down after {seconds(self.t_ns):.3f} s. MuJoCo says: {self._warned[0]} "
                f"Check masses, gains and timestep of the MJCF; a smaller timestep or arm.joint_speed may do."
            )

    @property
    def t_ns(self) -> int:
        """Nanoseconds since the world opened."""
        return self._ticks * self._tick_ns

    def move(self, q_rad: Array, over_s: float) -> float:
        """Begin a minimum-jerk move from where the set-point is now; raises BadInput for a goal of another length or not finite."""
        goal, n = np.array(q_rad, dtype=float), self._sim.arm.dof
        if goal.shape != (n,) or not np.all(np.isfinite(goal)):
            raise BadInput(f"a move to {goal.tolist()} was asked for, but dof={n} takes {n} finite numbers. Type e.g. {[0.1] * n}.")
        self._from = self._set_point()
        self._way = goal - self._from
        self._began_s, self._over_s = seconds(self.t_ns), over_s
        return over_s

    def present(self, source: str) -> None:
        """Swap the source; the air of the old one is gone, the new plume stands."""
        if source not in self._places:
            raise BadInput(f"present('{source}') was asked for, but a world has {', '.join(self._places)}.")
        self._open = source
        self._air.present(self._places[source], self._strengths[source] * self._sim.emission_ml_s)

    def samples(self, for_s: float) -> Iterator[WorldSample]:
        """Run for `for_s`, rounded to whole control ticks."""
        until_ns = self.t_ns + nanoseconds(for_s)
        while self.t_ns + self._tick_ns <= until_ns:
            self._move_on()
            yield self._encoders.read(self.t_ns, self._angles[self._joints])
            self._breathe()
            due = self.t_ns >= self._gas_due_ns
            if due or self._ticks % self._sim.truth_every == 0:
                yield self._truth()
            if due:
                self._wire.append(self._sniff())
            while self._wire and self._wire[0].t_ns + nanoseconds(self._sim.gas_delay_s) <= self.t_ns:
                yield replace(self._wire.popleft(), t_ns=self.t_ns)

    def _set_point(self) -> Array:
        return self._from + smooth((seconds(self.t_ns) - self._began_s) / self._over_s) * self._way

    def _move_on(self) -> None:
        self._ctrl[self._servos] = self._set_point() - self._encoders.offset
        self._step(self._substeps)
        self._ticks += 1

    def _breathe(self) -> None:
        sim = self._sim
        if self._ticks % sim.air_every == 0:
            self._air.step(sim.air_every * sim.joint_period_s)
        before, self._ppm = self._ppm, sim.background_ppm + self._air.ppm(self._nose_m)
        self._specimen.step(0.5 * (before + self._ppm), sim.joint_period_s)  # else the gas would be half a tick ahead of the nose

    def _sniff(self) -> GasSample:
        sample = GasSample(self.t_ns, self._element, self._specimen.sample(self._element, seconds(self.t_ns)))
        self._gas_due_ns += self._sample_ns
        self._element = (self._element + 1) % self._sim.sensor.elements
        return sample

    def _truth(self) -> Truth:
        place = self._places[self._open]
        source = np.full(3, np.nan) if place is None else place
        return Truth(self.t_ns, self._angles[self._joints], self._nose_m, source, self._ppm)


class _Encoders:
    """Counts with a drift 1/2 a t^2 and a homing offset; velocity and acceleration are differences of counts, as a bus gives them."""

    def __init__(self, accel: Array, homing: Array, step_rad: float, period_s: float) -> None:
        self._half_accel, self._homing, self._step, self._period = 0.5 * accel, homing, step_rad, period_s
        self.offset = homing  # what the encoders add to the joint angles now (n,) rad
        self._q: Array | None = None
        self._dq = np.zeros_like(accel)

    def read(self, t_ns: int, q_true: Array) -> JointState:
        """Quantised angle and its differences."""
        t_s = seconds(t_ns)
        self.offset = self._homing + self._half_accel * (t_s * t_s)
        q = np.rint((q_true + self.offset) / self._step) * self._step
        if self._q is None:
            dq = ddq = self._dq
        else:
            dq = (q - self._q) / self._period
            ddq = (dq - self._dq) / self._period
        self._q, self._dq = q, dq
        return JointState(t_ns, q, dq, ddq)
