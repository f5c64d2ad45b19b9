"""Scalar Kalman update in Joseph form, P = (I - K H) P (I - K H)' + K R K' (Bucy & Joseph 1968): positive definite for any gain."""

import numpy as np

from oio.core.compiled import compiled
from oio.core.records import Array, Belief, GasReading, Innovation
from oio.gas.censored import pseudo_measurement
from oio.inference.state_space import StateSpace


def gated_update(model: StateSpace, belief: Belief, reading: GasReading, gate_nis: float) -> tuple[Belief, Innovation]:
    """Return the posterior after one reading, and its innovation; a missed reading, or one beyond the NIS gate, changes nothing."""
    innovation, row, residual, r = _measured(model, belief, reading, gate_nis)
    if innovation.gated:
        return belief, innovation
    return Belief(reading.t_ns, *joseph(belief.mean, belief.cov, row, residual, r)), innovation


def innovation_of(model: StateSpace, belief: Belief, reading: GasReading, gate_nis: float) -> Innovation:
    """Return the innovation without an update. A missed reading (NaN or infinite) is gated, with residual 0."""
    return _measured(model, belief, reading, gate_nis)[0]


def _measured(model: StateSpace, belief: Belief, reading: GasReading, gate_nis: float) -> tuple[Innovation, Array, float, float]:
    """The innovation of a reading, and what `scalar_measurement` makes of it."""
    finite = GasReading(reading.t_ns, reading.element, 0.0, model.sigma_ppm) if reading.missed else reading
    row, residual, r = scalar_measurement(model, belief.mean, belief.cov, finite)
    s = float(row @ belief.cov @ row) + r
    residual = 0.0 if reading.missed else residual
    gated = reading.missed or residual * residual > gate_nis * s
    return Innovation(reading.t_ns, np.array([residual]), np.array([[s]]), gated), row, residual, r


def update(model: StateSpace, mean: Array, cov: Array, reading: GasReading) -> tuple[Array, Array]:
    """Return mean (N,) and covariance (N, N) after one reading."""
    row, residual, r = scalar_measurement(model, mean, cov, reading)
    return joseph(mean, cov, row, residual, r)


def scalar_measurement(model: StateSpace, mean: Array, cov: Array, reading: GasReading) -> tuple[Array, float, float]:
    """Return H (N,), residual [ppm] and R [ppm^2] of a reading; a censored one gives the pseudo-measurement of a truncated normal."""
    expected, row, r = model.measurement(mean, reading)
    residual = reading.ppm - expected
    if reading.censored:
        residual, r = pseudo_measurement(residual, float(row @ cov @ row) + r, r)
    return row, residual, r


@compiled
def joseph(mean: Array, cov: Array, row: Array, residual: float, r: float) -> tuple[Array, Array]:
    """Joseph-form update: mean (N,) and covariance (N, N), symmetric to the bit, for a row of H (N,), its residual and variance r."""
    ph = cov @ row
    gain = ph / (row @ ph + r)
    n = len(row)
    reduced, joseph_cov, out = np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    for i in range(n):
        for j in range(n):
            reduced[i, j] = cov[i, j] - gain[i] * ph[j]  # (I - K H) P, P symmetric
    rest = reduced @ row
    for i in range(n):
        for j in range(n):
            joseph_cov[i, j] = reduced[i, j] - rest[i] * gain[j] + r * (gain[i] * gain[j])
    for i in range(n):
        for j in range(n):
            out[i, j] = 0.5 * (joseph_cov[i, j] + joseph_cov[j, i])
    return mean + gain * residual, out
