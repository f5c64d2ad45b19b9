"""Encoders of the simulated arm: quantisation, drift and homing offset, unknown to the filter."""

import math

import numpy as np

from oio.core.records import Array
from oio.core.seeds import Seeds
from oio.kinematics.arm import Arm


class Encoders:
    """Encoders with quantisation, drift 1/2 a t^2 and homing offset."""

    def __init__(self, accel: Array, homing: Array, step_rad: float) -> None:
        self._half_accel, self._homing, self._step = 0.5 * accel, homing, step_rad
        self._more, self._more_since_s = 0.0, 0.0  # additional drift, over the drift drawn, and when it began
        self.offset = homing  # present offset of the encoders from the joint angles (n,) rad

    @classmethod
    def drawn(cls, arm: Arm, seeds: Seeds, counts_per_turn: int) -> "Encoders":
        """Create the encoders of an arm, with drift and homing offset drawn from the truth stream."""
        accel = math.radians(arm.encoder_drift_deg_s2) * seeds.rng("truth", "drift").uniform(-1, 1, arm.dof)
        homing = math.radians(arm.homing_offset_deg) * seeds.rng("truth", "homing").standard_normal(arm.dof)
        return cls(accel, homing, 2 * math.pi / counts_per_turn)

    def drift(self, t_s: float) -> None:
        """Update the offset to time t_s."""
        self.offset = self._homing + self._half_accel * (t_s * t_s)
        if self._more:
            self.offset = self.offset + self._more * self._half_accel * (t_s - self._more_since_s) ** 2

    def worsen(self, factor: float, t_s: float) -> None:
        """Multiply the drift acceleration by a factor from t_s on."""
        self._more, self._more_since_s = factor - 1.0, t_s

    def read(self, q_true: Array) -> Array:
        """Return the quantised angles (n,) rad of true angles (n,) rad."""
        return np.asarray(np.rint((q_true + self.offset) / self._step) * self._step)
