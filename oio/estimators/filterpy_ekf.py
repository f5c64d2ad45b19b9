"""filterpy's own ExtendedKalmanFilter on the same state-space model: the reference implementation for `ekf`."""

from typing import Annotated

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

from oio.core.records import Belief, GasReading, Innovation, JointState, seconds
from oio.core.settings import Within, settings
from oio.estimators.gated_update import innovation_of, scalar_measurement
from oio.inference.state_space import StateSpace


@settings
class FilterpyEkf:
    """Extended Kalman filter of filterpy 2.0, wrapped: belief in, belief out."""

    gate_nis: Annotated[float, Within(1, 1e9)]  # a reading whose NIS is larger is not used (chi-square, 1 degree of freedom)

    def predict(self, model: StateSpace, belief: Belief, joints: JointState) -> Belief:
        """Time update to the time of `joints`; the mean goes through the full transition, as filterpy's `predict_x` is meant to be used."""
        mean, jacobian, q = model.transition(belief.mean, seconds(joints.t_ns - belief.t_ns), joints)
        ekf = _filterpy_filter(belief)
        ekf.F, ekf.Q = jacobian, q
        ekf.predict()
        return Belief(joints.t_ns, mean, 0.5 * (ekf.P + ekf.P.T))

    def update(self, model: StateSpace, belief: Belief, reading: GasReading) -> tuple[Belief, Innovation]:
        """Measurement update: condition the belief on one reading taken now."""
        innovation = innovation_of(model, belief, reading, self.gate_nis)
        if innovation.gated:
            return belief, innovation
        row, residual, r = scalar_measurement(model, belief.mean, belief.cov, reading)
        ekf = _filterpy_filter(belief)
        ekf.update(np.array([residual]), lambda _: row[None, :], lambda _: np.zeros(1), R=np.array([[r]]))
        return Belief(reading.t_ns, ekf.x, 0.5 * (ekf.P + ekf.P.T)), innovation


def _filterpy_filter(belief: Belief) -> ExtendedKalmanFilter:
    ekf = ExtendedKalmanFilter(dim_x=len(belief.mean), dim_z=1)
    ekf.x, ekf.P = np.array(belief.mean), np.array(belief.cov)
    return ekf
