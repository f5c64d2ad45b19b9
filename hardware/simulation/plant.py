"""Simulated plant: MuJoCo moves the arm, the air model carries the gas, a sensor specimen measures it.

It has no wire and no clock of its own: the caller of `tick` sets the pace. `backend=mujoco` samples it; the emulators put it behind the
wire protocols of real devices. Each tick: servos get the set-point, through their drifting encoders; the arm moves; the air moves; the
sensor is exposed.
"""

import copy
import math
from typing import Any

import mujoco
import numpy as np

from hardware.simulation.encoders import Encoders
from hardware.simulation.exposed_sensor import ExposedSensor
from hardware.simulation.live_room import LiveRoom
from hardware.simulation.mujoco_model import compile_model, nose_site, servo_of
from hardware.simulation.plant_spec import PlantSpec
from oio.core.errors import BadInput, OioError
from oio.core.records import Array, Truth, nanoseconds, seconds
from oio.core.seeds import Seeds

END_STOP_RAD = math.radians(0.5)  # a joint this close to an end of its range is at its stop


class Plant:
    """Live plant. Time is counted in ticks of `spec.period_s`, so it never drifts."""

    _SETTLE_S = 1.0  # time to settle into the servos' sag and the backlash

    def __init__(self, spec: PlantSpec, warned: list[str]) -> None:
        self._spec, self._warned, self._ticks = spec, warned, 0
        self._model, self.mjcf = compile_model(spec.simulated_arm)
        self._data = mujoco.MjData(self._model)
        self.tick_ns, self._substeps = nanoseconds(spec.period_s), _substeps(spec.period_s, self._model.opt.timestep)
        truth, arm = spec.seeds, spec.arm
        self._encoders = Encoders.drawn(spec.arm, spec.seeds, spec.encoder_counts)
        specimen = spec.sensor.unit(truth.rng("truth", "specimen"), truth.rng("measurement", "sensor"))
        self._sensor = ExposedSensor(specimen, arm.element_offsets_m[: spec.sensor.elements], spec.background_ppm)
        self._room = LiveRoom(spec.air.open(truth.rng("truth", "air"), truth.rng("disturbance", "air")), spec.changes, spec.background_ppm)
        self.places = {
            "none": None,
            "beacon": spec.beacon.placed("beacon", arm, truth.rng("truth", "beacon")),
            "source": spec.source.placed("source", arm, truth.rng("truth", "source")),
        }
        self.strengths = {
            "none": 0.0,
            "beacon": spec.beacon.strength_drawn(truth.rng("truth", "beacon strength")),
            "source": spec.source.strength_drawn(truth.rng("truth", "source strength")),
        }
        self._open_source = "none"
        self._joints = np.array([self._model.joint(name).qposadr[0] for name in arm.names])
        self._hinges = np.array([self._model.joint(name).id for name in arm.names])
        self._servos = np.array([servo_of(self._model, name) for name in arm.names])
        self._view()
        self._links = self._model.jnt_bodyid[self._hinges]
        self._torque = np.zeros(arm.dof)
        limit = np.max(np.abs(self._model.actuator_forcerange[self._servos]), axis=1)
        self._torque_limit = np.where(limit > 0, limit, np.inf)
        (low, high), limited = self._model.jnt_range[self._hinges].T, self._model.jnt_limited[self._hinges].astype(bool)
        self._stop_low, self._stop_high = np.where(limited, low + END_STOP_RAD, -np.inf), np.where(limited, high - END_STOP_RAD, np.inf)
        self._settle_at_home()

    def _view(self) -> None:
        """Take views of the live data."""
        self._site, self._angles, self._ctrl = self._data.site(nose_site(self._spec.arm)), self._data.qpos, self._data.ctrl

    def __deepcopy__(self, memo: dict[int, Any]) -> "Plant":
        """A plant that goes on from here as this one would; the model, which never changes, is shared."""
        made = copy.copy(self)
        memo[id(self)] = made
        made._data, made._warned = copy.copy(self._data), []
        changing = ("_encoders", "_sensor", "_room", "places", "strengths", "_torque")
        for name, value in copy.deepcopy({name: getattr(self, name) for name in changing}, memo).items():
            setattr(made, name, value)
        made._view()
        return made

    def _settle_at_home(self) -> None:
        for name, home in zip(self._spec.arm.all_names, self._spec.arm.home_rad, strict=True):
            self._data.joint(name).qpos = home
            self._data.ctrl[servo_of(self._model, name)] = home
        self._step(round(self._SETTLE_S / self._model.opt.timestep), feel=True)
        self._data.time = 0.0

    def _step(self, count: int, feel: bool) -> None:
        """Step the physics. The torque, if felt, is the mean over the steps: it oscillates over its whole range after a new set-point."""
        if feel:
            self._torque = np.zeros(len(self._servos))
            for _ in range(count):
                mujoco.mj_step(self._model, self._data)
                self._torque += self._data.actuator_force[self._servos]
            self._torque /= count
        else:
            mujoco.mj_step(self._model, self._data, count)
        if self._warned:  # MuJoCo itself would continue, after bad numbers from the pose of the MJCF
            raise OioError(
                f"the physics of {self._spec.arm.mjcf} broke down after {seconds(self.t_ns):.3f} s. MuJoCo says: {self._warned[0]} "
                f"Check masses, gains and timestep of the MJCF; a smaller timestep or arm.joint_speed may do."
            )

    @property
    def warned(self) -> list[str]:
        """MuJoCo's warnings."""
        return self._warned

    @property
    def t_ns(self) -> int:
        """Nanoseconds since the plant was created."""
        return self._ticks * self.tick_ns

    @property
    def ticks(self) -> int:
        """Number of control periods so far."""
        return self._ticks

    def present(self, source: str) -> None:
        """Replace the source; the old gas is removed, the new plume is developed."""
        if source not in self.places:
            raise BadInput(f"present('{source}') was asked for, but a world has {', '.join(self.places)}.")
        self._open_source = source
        before = self._room.changed
        self._room.present(source, self.places[source], self.strengths[source] * self._spec.emission_ml_s)
        if self._room.changed and not before:
            self._begin_changes()

    def renew(self, seeds: Seeds) -> None:
        """Draw what differs between two searches on one bench: place and strength of the source, turbulence, sensor noise.

        Arm, specimen, mean wind and the beacon stay. The air is clean until a source is presented.
        """
        spec, own = self._spec, self._spec.seeds
        self.places["source"] = spec.source.placed("source", spec.arm, seeds.rng("truth", "source"))
        self.strengths["source"] = spec.source.strength_drawn(seeds.rng("truth", "source strength"))
        self._room = self._room.with_air(spec.air.open(own.rng("truth", "air"), seeds.rng("disturbance", "air")))
        self._open_source = "none"
        self._sensor.renew_noise(seeds.rng("measurement", "sensor"))

    def _begin_changes(self) -> None:
        self._encoders.worsen(self._spec.changes.drift_factor, seconds(self.t_ns))
        self._sensor.change(self._spec.changes)

    def _nose_m(self) -> Array:
        """True position of the nose (3,) m."""
        if not self._room.changed or not any(self._spec.changes.nose_offset_m):
            return np.asarray(self._site.xpos)
        return np.asarray(self._site.xpos + self._site.xmat.reshape(3, 3) @ np.array(self._spec.changes.nose_offset_m))

    def tick(self, set_point: Array, feel: bool = True) -> None:
        """Advance one control period with the servos' set-point (n,) rad, in encoder angles. `feel`: `load` will be asked for."""
        self._ctrl[self._servos] = set_point - self._encoders.offset
        self._step(self._substeps, feel)
        self._ticks += 1
        self._encoders.drift(seconds(self.t_ns))
        self._expose_sensor()

    def _expose_sensor(self) -> None:
        spec = self._spec
        if self._ticks % spec.air_every == 0:
            self._room.step(spec.air_every * spec.period_s)
        nose_m = self._nose_m()
        joints_m = np.vstack([self._data.xpos[self._links], nose_m]) if self._room.casts_shadow else None
        self._sensor.expose(self._room, nose_m, self._site.xmat.reshape(3, 3), joints_m, spec.period_s)

    def encoders(self) -> Array:
        """Encoder readings q (n,) rad, in whole counts."""
        return self._encoders.read(self._angles[self._joints])

    def fine_angles(self) -> Array:
        """Encoder angles without quantisation (n,) rad, for interpolation between ticks."""
        return np.asarray(self._angles[self._joints] + self._encoders.offset)

    def load(self) -> Array:
        """Torque of the servos, mean of the last tick that was felt, over their limit (n,), -1 to 1; zero where the MJCF sets no limit."""
        return np.asarray(self._torque / self._torque_limit)

    def at_stop(self) -> Array:
        """Which joints (n,) are at an end of their range."""
        q = self._angles[self._joints]
        return np.asarray((q < self._stop_low) | (q > self._stop_high))

    def raw(self, element: int) -> float:
        """Raw value of the sensor's electronics at present."""
        return self._sensor.unit.sample(element, seconds(self.t_ns))

    def truth(self) -> Truth:
        """True state at present."""
        place = self.places[self._open_source]
        source = np.full(3, np.nan) if place is None else place
        return Truth(self.t_ns, self._angles[self._joints], self._nose_m(), source, self._sensor.ppm)


def _substeps(period_s: float, timestep_s: float) -> int:
    count = round(period_s / timestep_s)
    if not math.isclose(count * timestep_s, period_s):
        raise BadInput(f"backend.joint_period_s is {period_s}, but it must be a multiple of the MJCF's {timestep_s} s.")
    return count
