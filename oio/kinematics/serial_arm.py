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

    @property
    def element_offsets_m(self) -> Array:
        """Where the sensor's elements are, from the nose and in its frame (2, 3) m; zero: all are at the nose."""
        return np.zeros((2, 3))

    @cached_property
    def element_chains(self) -> tuple[SerialChain, SerialChain]:
        """The chain that ends at either element."""
        first, second = (self._chain_to(offset_m) for offset_m in self.element_offsets_m)
        return first, second

    @cached_property
    def adjoints(self) -> tuple[AdjointChain, AdjointChain]:
        """The same for `oio.kinematics.adjoint`: the joints that move."""
        first, second = (adjoint_chain(chain, self.dof) for chain in self.element_chains)
        return first, second

    def _chain_to(self, offset_m: Array) -> SerialChain:
        if not np.any(offset_m):
            return self.chain
        return self.chain._replace(offset=np.asarray(self.chain.offset + self.model.nose_rotation @ offset_m))

    @cached_property
    def spacing_m(self) -> float:
        """Distance between the two elements [m]."""
        first, second = self.element_offsets_m
        return float(np.linalg.norm(first - second))

    def place_of(self, elements: int) -> tuple[int, ...]:
        """Index of the place of each of so many elements: 0, and 1 for a second element that is not where the first is."""
        return tuple(range(elements)) if self.spacing_m > 0.0 else (0,) * elements

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

    def board(self, q_rad: Array, elements: int) -> Array:
        """Middle (k, 3) m of the places of so many elements for unlocked joints q_rad (k, n): the nose, unless they are elsewhere."""
        if not np.any(self.element_offsets_m[:elements]):
            return self.nose(q_rad)
        return np.asarray(np.mean(self.element_jacobians(q_rad, elements)[0], axis=0))

    def element_jacobians(self, q_rad: Array, elements: int) -> tuple[Array, Array]:
        """Places p_base_element (P, k, 3) m of so many elements, one for each distinct place, and their Jacobians (P, k, 3, n) m/rad, for
        unlocked joints q_rad (k, n)."""
        count = max(self.place_of(elements)) + 1
        found = [nose_and_jacobian(self._rows(q_rad), chain, True) for chain in self.element_chains[:count]]
        return np.array([p for p, _ in found]), np.array([jacobian for _, jacobian in found])

    def _rows(self, q_rad: Array) -> Array:
        q = np.ascontiguousarray(q_rad, dtype=np.float64)
        if q.shape[-1] != self.dof:
            raise ValueError(f"expected {self.dof} joint values, got {q.shape[-1]}")
        return (q if q.flags.writeable else q.copy()).reshape(-1, self.dof)  # of one type, so that it is compiled once
