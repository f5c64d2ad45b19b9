"""Cubature Kalman filter with filterpy's spherical-radial points (Arasaratnam & Haykin 2009); a linear measurement needs no points."""

from typing import Annotated

import numpy as np
from filterpy.kalman.CubatureKalmanFilter import spherical_radial_sigmas

from oio.core.records import Belief, GasReading, Innovation, JointState
from oio.core.settings import Within, settings
from oio.estimators.gated_update import gated_update
from oio.estimators.sigma_points import propagate
from oio.inference.state_space import StateSpace


@settings
class Ckf:
    """Cubature Kalman filter: 2 N points of equal weight, sqrt(N) standard deviations from the mean."""

    gate_nis: Annotated[float, Within(1, 1e9)]  # a reading whose NIS is larger is not used (chi-square, 1 degree of freedom)

    def predict(self, model: StateSpace, belief: Belief, joints: JointState) -> Belief:
        """Time update: propagate the belief to the time of `joints`."""
        zero, weights = np.zeros(model.size), np.full(2 * model.size, 0.5 / model.size)
        return propagate(model, belief, joints, lambda c: spherical_radial_sigmas(zero, c), (weights, weights))

    def update(self, model: StateSpace, belief: Belief, reading: GasReading) -> tuple[Belief, Innovation]:
        """Measurement update: condition the belief on one reading taken now."""
        return gated_update(model, belief, reading, self.gate_nis)
