"""One scalar update in Joseph form, P = (I - K H) P (I - K H)' + K R K' (Bucy & Joseph 1968): positive definite whatever the gain."""

import numpy as np

from oio.model import Model
from oio.records import Belief, GasReading, Innovation


def condition(model: Model, belief: Belief, reading: GasReading, gate_nis: float) -> tuple[Belief, Innovation]:
    """The belief after one reading, and its innovation; beyond the gate the belief stays as it was."""
    expected, row, r = model.measurement(belief.mean, reading)
    to = belief.cov @ row
    s = float(row @ to) + r
    residual = reading.ppm - expected
    gated = residual * residual > gate_nis * s
    innovation = Innovation(reading.t_ns, np.array([residual]), np.array([[s]]), gated)
    if gated:
        return belief, innovation
    gain = to / s
    left = np.eye(len(to)) - np.outer(gain, row)
    cov = left @ belief.cov @ left.T + r * np.outer(gain, gain)
    return Belief(reading.t_ns, belief.mean + gain * residual, 0.5 * (cov + cov.T)), innovation
