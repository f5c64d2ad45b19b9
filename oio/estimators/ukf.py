"""Unscented Kalman filter with filterpy's sigma points (van der Merwe 2004); a reading is linear in the state, so its update is exact."""

from typing import Annotated

import numpy as np
from filterpy.kalman import MerweScaledSigmaPoints

from oio.core.errors import BadInput
from oio.core.records import Belief, GasReading, Innovation, JointState
from oio.core.settings import Within, settings
from oio.estimators.gated_update import gated_update
from oio.estimators.sigma_points import propagate
from oio.inference.state_space import StateSpace


@settings
class Ukf:
    """Unscented Kalman filter: 2 N + 1 points, alpha sqrt(N + kappa) standard deviations from the mean."""

    gate_nis: Annotated[float, Within(1, 1e9)]  # a reading whose NIS is larger is not used (chi-square, 1 degree of freedom)
    alpha: Annotated[float, Within(1e-2, 10)]  # spread of the sigma points
    beta: Annotated[float, Within(0, 1e3)]  # weight of the centre point in the covariance; 2 for a Gaussian
    kappa: Annotated[float, Within(0, 100)]  # secondary scaling of the spread

    def check(self) -> None:
        """Raise BadInput for weights that can make a covariance indefinite.

        With beta >= alpha^2 the covariance is at least that about the centre point, a sum of squares (Julier et al. 2000).
        """
        if self.beta < self.alpha**2:
            least = f"at least alpha^2 = {self.alpha**2:g}, or covariances turn negative"
            raise BadInput(f"Ukf.beta is {self.beta:g}, but it must be {least}. Type e.g. ekf.beta={max(2.0, self.alpha**2):g}.")

    def predict(self, model: StateSpace, belief: Belief, joints: JointState) -> Belief:
        """Time update: propagate the belief to the time of `joints`."""
        points = MerweScaledSigmaPoints(model.size, self.alpha, self.beta, self.kappa)
        zero = np.zeros(model.size)
        return propagate(model, belief, joints, lambda c: points.sigma_points(zero, c), (points.Wm, points.Wc))

    def update(self, model: StateSpace, belief: Belief, reading: GasReading) -> tuple[Belief, Innovation]:
        """Measurement update: condition the belief on one reading taken now."""
        return gated_update(model, belief, reading, self.gate_nis)
