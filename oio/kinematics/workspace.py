"""Where an arm may go: joint limits, the box of its nose, poses within both, and how long a move takes."""

import numpy as np
from numpy.typing import NDArray

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.kinematics.inverse import solve_positions
from oio.kinematics.minimum_jerk import PEAK_OVER_MEAN
from oio.kinematics.serial_arm import SerialArm


class Workspace(SerialArm):
    """A serial arm with limits."""

    name: str
    box_low_m: tuple[float, float, float]
    box_high_m: tuple[float, float, float]
    joint_speed: float
    nose_speed_m_s: float
    random_span_rad: float | None

    @property
    def low_rad(self) -> Array:
        """Lower limits of the unlocked joints (n,)."""
        return self.model.low[: self.dof]

    @property
    def high_rad(self) -> Array:
        """Upper limits of the unlocked joints (n,)."""
        return self.model.high[: self.dof]

    def is_allowed(self, q_rad: Array) -> bool:
        """Whether the joints are within limits and the nose within its box."""
        return bool(self._in_box(self._rows(q_rad))[0])

    def _in_box(self, q: Array) -> NDArray[np.bool_]:
        """The same of joints q (k, n): (k,)."""
        p = self.nose(q)
        boxed = np.all((p >= self.box_low_m) & (p <= self.box_high_m), axis=1)
        return np.asarray(boxed & np.all((q >= self.low_rad) & (q <= self.high_rad), axis=1))

    def validated(self, q_rad: Array) -> Array:
        """The command itself, if it may be sent: right length, finite, within limits and box; else BadInput says what is wrong."""
        q = np.asarray(q_rad, dtype=float)
        if q.shape != (self.dof,):
            raise BadInput(f"a move of {q.shape} joint values was asked for, but dof={self.dof} takes ({self.dof},).")
        if not np.all(np.isfinite(q)):
            raise BadInput(f"a move to {q.tolist()} was asked for, but every joint needs a finite number.")
        if not self.is_allowed(q):
            p = self.nose(q)
            raise BadInput(
                f"a move to {_rounded(q, 4)} rad (nose at {_rounded(p, 3)} m) was asked for, but joints may go "
                f"from {self.low_rad.tolist()} to {self.high_rad.tolist()} rad and the nose from {self.box_low_m} to {self.box_high_m} m."
            )
        return q

    def duration_s(self, q_from: Array, q_to: Array) -> Array:
        """Seconds (...) for smooth moves to q_to (..., n): minimum jerk peaks at 1.875 times its mean speed (Flash & Hogan 1985)."""
        joints = np.max(np.abs(q_to - q_from), axis=-1) / self.joint_speed
        nose = np.linalg.norm(self.nose(q_to) - self.nose(q_from), axis=-1) / self.nose_speed_m_s
        return np.asarray(PEAK_OVER_MEAN * np.maximum(joints, nose))

    def solve_ik(self, p_m: Array, q_from: Array, tolerance_m: float = 0.005) -> Array | None:
        """Joints (n,) that bring the nose within tolerance_m of p_m (3,), by damped least squares from q_from; None if it cannot."""
        q, there = self.solve_ik_all(np.asarray(p_m)[None, :], np.asarray(q_from)[None, :], tolerance_m)
        return q[0] if there[0] else None

    def solve_ik_all(self, p_m: Array, q_from: Array, tolerance_m: float = 0.005) -> tuple[Array, NDArray[np.bool_]]:
        """Joints (k, n) that bring the nose within tolerance_m of p_m (k, 3), each begun from its row of q_from (k, n), and whether they do
        (k,) within limits and box."""
        goals = np.ascontiguousarray(p_m, dtype=np.float64)
        q, there = solve_positions(goals, self._rows(q_from), self.low_rad, self.high_rad, tolerance_m, self.chain)
        return q, there & self._in_box(q)

    def path_is_free(self, q_from: Array, q_to: Array) -> NDArray[np.bool_]:
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
        """So many (count, n), within `random_span_rad` of home. Raises BadInput if the box leaves no room.

        As many are drawn at once as are wanted still, never one too many: they are those drawn one by one.
        """
        found, in_vain = np.empty((0, self.dof)), 0
        low, high = self._random_limits()
        while in_vain < 10_000:
            q = rng.uniform(low, high, (count - len(found), self.dof))
            fit = q[self._in_box(q)]
            found, in_vain = np.concatenate([found, fit]), 0 if len(fit) else in_vain + len(q)
            if len(found) == count:
                return found
        raise BadInput(f"no pose of arm '{self.name}' with dof={self.dof} keeps the nose inside arm.box_low_m to arm.box_high_m; widen it.")

    def _random_limits(self) -> tuple[Array, Array]:
        """Limits (n,), (n,) of random poses."""
        home, span = np.array(self.home_rad[: self.dof]), np.inf if self.random_span_rad is None else self.random_span_rad
        return np.maximum(self.low_rad, home - span), np.minimum(self.high_rad, home + span)


def _line_in_joint_space(q_from: Array, q_to: Array, begin: float, places: int) -> Array:
    """Joints (places, ..., n) on the straight line from the fraction `begin` of it to its end."""
    fraction = np.linspace(begin, 1.0, places).reshape(-1, *(1,) * np.ndim(q_to))
    return np.asarray(q_from + fraction * (q_to - q_from))


def _rounded(values: Array, digits: int) -> list[float]:
    """Values for a message; NumPy's own overflows for what is next to infinity."""
    return [round(float(value), digits) for value in values]
