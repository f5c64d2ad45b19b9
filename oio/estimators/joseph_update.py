"""One scalar update in Joseph form, P = (I - K H) P (I - K H)' + K R K' (Bucy & Joseph 1968): positive definite whatever the gain."""

import numpy as np

from oio.core.compiled import compiled
from oio.core.records import Array, Belief, GasReading, Innovation
from oio.gas.censored import pseudo_measurement
from oio.inference.state_space import StateSpace


def gated_update(model: StateSpace, belief: Belief, reading: GasReading, gate_nis: float) -> tuple[Belief, Innovation]:
    """The belief after one reading, and its innovation; after a reading beyond the gate, or a missed one, the belief is as it was."""
    innovation = innovation_of(model, belief, reading, gate_nis)
    if innovation.gated:
        return belief, innovation
    mean, cov = update(model, belief.mean, belief.cov, reading)
    return Belief(reading.t_ns, mean, cov), innovation


def innovation_of(model: StateSpace, belief: Belief, reading: GasReading, gate_nis: float) -> Innovation:
    """The innovation alone. A missed reading (NaN or infinite) is gated and has no residual: 0."""
    seen = GasReading(reading.t_ns, reading.element, 0.0, model.sigma_ppm) if reading.missed else reading
    row, residual, r = scalar_measurement(model, belief.mean, belief.cov, seen)
    s = float(row @ belief.cov @ row) + r
    residual = 0.0 if reading.missed else residual
    gated = reading.missed or residual * residual > gate_nis * s
    return Innovation(reading.t_ns, np.array([residual]), np.array([[s]]), gated)


def update(model: StateSpace, mean: Array, cov: Array, reading: GasReading) -> tuple[Array, Array]:
    """Mean (N,) and cov (N, N) after one reading."""
    row, residual, r = scalar_measurement(model, mean, cov, reading)
    mean, cov = joseph(mean, cov, row, residual, r)
    return mean, cov


def scalar_measurement(model: StateSpace, mean: Array, cov: Array, reading: GasReading) -> tuple[Array, float, float]:
    """H (N,), residual [ppm] and R [ppm^2] of a reading; a censored one is matched to the normal that is cut off at its limit."""
    expected, row, r = model.measurement(mean, reading)
    residual = reading.ppm - expected
    if reading.censored:
        residual, r = pseudo_measurement(residual, float(row @ cov @ row) + r, r)
    return row, residual, r


@compiled
def joseph(mean: Array, cov: Array, row: Array, residual: float, r: float) -> tuple[Array, Array]:
    """Mean (N,) and cov (N, N), symmetric to the bit, after a row of H (N,) and its residual."""
    to = cov @ row
    gain = to / (row @ to + r)
    left = cov - np.outer(gain, to)  # (I - K H) P, P symmetric
    out = left - np.outer(left @ row, gain) + r * np.outer(gain, gain)
    return mean + gain * residual, 0.5 * (out + out.T)
