"""Joint names, the DoF ladder, nose position and Jacobian, limits: read from the MJCF, for real and simulated arms alike."""

from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from oio.core.errors import BadInput
from oio.core.folders import ROOT
from oio.core.records import Array
from oio.core.settings import settings
from oio.kinematics.adjoint import AdjointChain, adjoint_chain
from oio.kinematics.forward import SerialChain, nose_and_jacobian
from oio.kinematics.homing import Homing
from oio.kinematics.inverse import solve_positions
from oio.kinematics.model_loading import KinematicChain, load_chain


@settings
class Arm:
    """An arm: which MJCF, how its degrees of freedom are unlocked, where it rests, and how fast it may go.

    Joints beyond `dof` are locked (braked) at `home_rad`; every vector of joints in OIO has the `dof` unlocked ones only.
    """

    name: str
    mjcf: str  # path of the MJCF, relative to the folder that holds `oio/`
    dof: int  # how many joints move, a rung of the ladder
    ladder: tuple[int, ...]  # rungs in the order of calibration
    home_rad: tuple[float, ...]  # rest pose, all joints
    box_low_m: tuple[float, float, float]  # the nose stays in this box (table, base, person) in the base frame
    box_high_m: tuple[float, float, float]
    joint_speed: float  # rad/s (m/s for slides)
    nose_speed_m_s: float  # m/s
    nose_limit_m_s: float  # m/s; `duration_s` plans by the chord, and on a bent way the nose is faster
    encoder_drift_deg_s2: float  # bound on the encoders' quadratic drift
    homing_offset_deg: float  # standard deviation of the homing offset
    homing: str | None  # file of `python -m hardware.home`, whose uncertainties come on top
    backlash_deg: float  # free play, peak to peak

    def check(self) -> None:
        """Refuse a DoF off the ladder, a home of the wrong length or out of limits, and senseless speeds."""
        if self.dof not in self.ladder:
            rungs = ", ".join(map(str, self.ladder))
            raise BadInput(f"dof={self.dof} is not on the ladder of arm '{self.name}'. It can be {rungs}. Type e.g. dof={self.ladder[-1]}.")
        if len(self.home_rad) != len(self.all_names):
            raise BadInput(f"arm.home_rad has {len(self.home_rad)} values, but {self.mjcf} has {len(self.all_names)} joints.")
        low, high = self._model.low, self._model.high
        home = np.array(self.home_rad)
        if np.any(home < low) or np.any(home > high):
            raise BadInput(f"arm.home_rad is {list(self.home_rad)}, but the limits are {low.tolist()} to {high.tolist()} rad.")
        if self.homing is not None:
            _ = self.homed  # a wrong file is refused now
        for key in ("joint_speed", "nose_speed_m_s", "nose_limit_m_s"):
            if not getattr(self, key) > 0:
                raise BadInput(f"arm.{key} is {getattr(self, key)}, but it must be greater than 0.")
        for key in ("encoder_drift_deg_s2", "homing_offset_deg", "backlash_deg"):
            if getattr(self, key) < 0:
                raise BadInput(f"arm.{key} is {getattr(self, key)}, but it must be 0 or more.")

    @property
    def path(self) -> Path:
        """The MJCF file; raises BadInput if it is missing."""
        path = Path(self.mjcf) if Path(self.mjcf).is_absolute() else ROOT / self.mjcf
        if not path.is_file():
            raise BadInput(f"arm.mjcf is {self.mjcf}, but there is no such file. Give the path of an MJCF with a site named 'nose'.")
        return path

    @cached_property
    def _model(self) -> KinematicChain:
        return load_chain(self.path)

    @cached_property
    def all_names(self) -> tuple[str, ...]:
        """Names of all joints, base to nose."""
        return self._model.names

    @cached_property
    def homed(self) -> Homing | None:
        """What the homing file says of all joints; None without one."""
        return None if self.homing is None else Homing.read(self.homing, len(self.all_names))

    @property
    def homing_u_deg(self) -> Array:
        """Standard uncertainty of the unlocked joints' zeros (n,) degrees."""
        read = self.homed
        return np.hypot(self.homing_offset_deg, np.zeros(self.dof) if read is None else np.array(read.u_deg[: self.dof]))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the unlocked joints."""
        return self.all_names[: self.dof]

    @property
    def low_rad(self) -> Array:
        """Lower limits of the unlocked joints (n,)."""
        return self._model.low[: self.dof]

    @property
    def high_rad(self) -> Array:
        """Upper limits of the unlocked joints (n,)."""
        return self._model.high[: self.dof]

    @property
    def home(self) -> Array:
        """The rest pose of the unlocked joints (n,) rad."""
        return np.array(self.home_rad[: self.dof])

    @property
    def shoulder(self) -> Array:
        """Where the first joint sits (3,) m: bearings are seen from here."""
        return self._model.poses[0, :3, 3]

    def nose(self, q_rad: Array) -> Array:
        """Nose position p_base_nose (..., 3) m from unlocked joints q_rad (..., n)."""
        q = self._rows(q_rad)
        p, _ = nose_and_jacobian(q, self.chain, False)
        return p.reshape(*np.shape(q_rad)[:-1], 3)

    def nose_jacobian(self, q_rad: Array) -> tuple[Array, Array]:
        """p_base_nose (..., 3) m and its Jacobian dp/dq (..., 3, n) m/rad for unlocked joints q_rad (..., n)."""
        q = self._rows(q_rad)
        shape = np.shape(q_rad)[:-1]
        p, jacobian = nose_and_jacobian(q, self.chain, True)
        return p.reshape(*shape, 3), jacobian.reshape(*shape, 3, self.dof)

    def _rows(self, q_rad: Array) -> Array:
        q = np.ascontiguousarray(q_rad, dtype=np.float64)
        if q.shape[-1] != self.dof:
            raise ValueError(f"expected {self.dof} joint values, got {q.shape[-1]}")
        return q.reshape(-1, self.dof)

    @cached_property
    def chain(self) -> SerialChain:
        """The kinematic chain for compiled code, locked joints at home."""
        c = self._model
        return SerialChain(c.poses, c.axes, c.kinds, np.array(self.home_rad), c.nose_offset)

    @cached_property
    def adjoint(self) -> AdjointChain:
        """The same for `oio.kinematics.adjoint`: the joints that move."""
        return adjoint_chain(self.chain, self.dof)

    def inside(self, q_rad: Array) -> bool:
        """Whether the joints are within limits and the nose within its box."""
        return bool(self._in_box(self._rows(q_rad))[0])

    def _in_box(self, q: Array) -> NDArray[np.bool_]:
        """The same of joints q (k, n): (k,)."""
        p = self.nose(q)
        boxed = np.all((p >= self.box_low_m) & (p <= self.box_high_m), axis=1)
        return np.asarray(boxed & np.all((q >= self.low_rad) & (q <= self.high_rad), axis=1))

    def checked(self, q_rad: Array) -> Array:
        """The command itself, if it may be sent: right length, finite, within limits and box; else BadInput says what is wrong."""
        q = np.asarray(q_rad, dtype=float)
        if q.shape != (self.dof,):
            raise BadInput(f"a move of {q.shape} joint values was asked for, but dof={self.dof} takes ({self.dof},).")
        if not np.all(np.isfinite(q)):
            raise BadInput(f"a move to {q.tolist()} was asked for, but every joint needs a finite number.")
        if not self.inside(q):
            p = self.nose(q)
            raise BadInput(
                f"a move to {np.round(q, 4).tolist()} rad (nose at {np.round(p, 3).tolist()} m) was asked for, but joints may go "
                f"from {self.low_rad.tolist()} to {self.high_rad.tolist()} rad and the nose from {self.box_low_m} to {self.box_high_m} m."
            )
        return q

    def duration_s(self, q_from: Array, q_to: Array) -> Array:
        """Seconds (...) for smooth moves to q_to (..., n): minimum jerk peaks at 1.875 times its mean speed (Flash & Hogan 1985)."""
        joints = np.max(np.abs(q_to - q_from), axis=-1) / self.joint_speed
        nose = np.linalg.norm(self.nose(q_to) - self.nose(q_from), axis=-1) / self.nose_speed_m_s
        return np.asarray(1.875 * np.maximum(joints, nose))

    def reach(self, p_m: Array, q_from: Array, tolerance_m: float = 0.005) -> Array | None:
        """Joints (n,) that bring the nose within tolerance_m of p_m (3,), by damped least squares from q_from; None if it cannot."""
        q, there = self.reach_all(np.asarray(p_m)[None, :], np.asarray(q_from)[None, :], tolerance_m)
        return q[0] if there[0] else None

    def reach_all(self, p_m: Array, q_from: Array, tolerance_m: float = 0.005) -> tuple[Array, NDArray[np.bool_]]:
        """Joints (k, n) that bring the nose within tolerance_m of p_m (k, 3), each begun from its row of q_from (k, n), and whether they do
        (k,) within limits and box."""
        goals = np.ascontiguousarray(p_m, dtype=np.float64)
        q, there = solve_positions(goals, self._rows(q_from), self.low_rad, self.high_rad, tolerance_m, self.chain)
        return q, there & self._in_box(q)

    def free(self, q_from: Array, q_to: Array) -> NDArray[np.bool_]:
        """Whether the nose stays in its box (...) all the way to q_to (..., n) (a straight line in joint space)."""
        p = self.nose(_line_in_joint_space(q_from, q_to, 0.0, 12)[1:])
        return np.asarray(np.all((p >= self.box_low_m) & (p <= self.box_high_m), axis=(0, -1)))

    def clearance_m(self, q_from: Array, q_to: Array, p_m: Array) -> Array:
        """How near (...) m the nose comes to p_m (3,) on its straight way in joint space to q_to (..., n), after the first quarter."""
        return np.asarray(np.min(np.linalg.norm(self.nose(_line_in_joint_space(q_from, q_to, 0.25, 10)) - p_m, axis=-1), axis=0))

    def random_pose(self, rng: np.random.Generator) -> Array:
        """A uniformly drawn pose (n,) inside limits and box; raises BadInput if the box leaves no room."""
        return np.asarray(self.random_poses(rng, 1)[0])

    def random_poses(self, rng: np.random.Generator, count: int) -> Array:
        """So many (count, n). As many are drawn at once as are wanted still, never one too many: they are those drawn one by one."""
        found, in_vain = np.empty((0, self.dof)), 0
        while in_vain < 10_000:
            q = rng.uniform(self.low_rad, self.high_rad, (count - len(found), self.dof))
            fit = q[self._in_box(q)]
            found, in_vain = np.concatenate([found, fit]), 0 if len(fit) else in_vain + len(q)
            if len(found) == count:
                return found
        raise BadInput(f"no pose of arm '{self.name}' with dof={self.dof} keeps the nose inside arm.box_low_m to arm.box_high_m; widen it.")


def _line_in_joint_space(q_from: Array, q_to: Array, begin: float, places: int) -> Array:
    """Joints (places, ..., n) on the straight line from the fraction `begin` of it to its end."""
    fraction = np.linspace(begin, 1.0, places).reshape(-1, *(1,) * np.ndim(q_to))
    return np.asarray(q_from + fraction * (q_to - q_from))


def smooth(fraction: float) -> float:
    """Minimum-jerk profile 10 x^3 - 15 x^4 + 6 x^5 on [0, 1] (Flash & Hogan 1985)."""
    x = min(max(fraction, 0.0), 1.0)
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))
