"""Forward kinematics of an arm whose first joints move while the others are locked."""

from abc import ABC, abstractmethod
from functools import cached_property

import numpy as np

from oio.core.records import Array
from oio.kinematics.adjoint import AdjointChain, adjoint_chain
from oio.kinematics.chain_from_model import KinematicChain
from oio.kinematics.forward import SerialChain, nose_and_jacobian


class SerialArm(ABC):
    """Nose position and Jacobian. Vectors of joints have the `dof` unlocked ones only; the others stay at `home_rad`."""

    dof: int
    home_rad: tuple[float, ...]

    @property
    @abstractmethod
    def model(self) -> KinematicChain:
        """All joints, as the model file has them."""

    @cached_property
    def chain(self) -> SerialChain:
        """The kinematic chain for compiled code, locked joints at home."""
        c = self.model
        return SerialChain(c.poses, c.axes, c.kinds, np.array(self.home_rad), c.nose_offset)

    @cached_property
    def adjoint(self) -> AdjointChain:
        """The same for `oio.kinematics.adjoint`: the joints that move."""
        return adjoint_chain(self.chain, self.dof)

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
