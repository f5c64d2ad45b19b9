"""The forward model compiled: one pass along a path, from joints over nose position, mean field and sensor lag to the expected readings.

The lag is first order, the concentration c linear in each step (first-order hold): f_i = phi f_{i-1} + w0 c_{i-1} + w1 c_i,
phi = exp(-dt_i / tau), w1 = 1 - (1 - phi) tau / dt, w0 = 1 - phi - w1; tau is `rise` or `fall` by the sign of c_i - f_{i-1}.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from oio.core.compiled import compiled
from oio.core.records import Array
from oio.gas.range_law import LAW, SX, SY, SZ, concentration_at
from oio.kinematics.adjoint import BLOCK, ROWS, AdjointChain, forward_positions, gradient_by_joints


class SensedPath(NamedTuple):
    """A path of the joints and the readings on it."""

    t_s: Array  # (k,)
    q: Array  # (k, n) rad
    at: NDArray[np.int64]  # (m,), of each reading its place on the path
    element: NDArray[np.int64]  # (m,), and its element


class LawScale(NamedTuple):
    """The fixed lengths of a range law."""

    r_ref_m: float
    radius_m: float


class Lag(NamedTuple):
    """First-order lag of the sensor."""

    rise_s: float
    fall_s: float


class ExpectedPath(NamedTuple):
    """What `predict_readings` gives."""

    ppm: Array  # (m,), expected readings without offsets
    rows: Array  # (m, P), their derivatives by theta, those by the offsets included; (0, P) if they were not wanted
    gain: Array  # (m,), of each reading's element
    along: Array  # (6, k): c [ppm], rarity, r [m], speed of the nose [m/s], dt [s], tau [s]
    lagged_ppm: float  # concentration at the end of the path, through the lag


@compiled
def predict_readings(
    theta: Array, path: SensedPath, first_ppm: float, chain: AdjointChain, law: LawScale, lag: Lag, want_rows: bool
) -> ExpectedPath:
    """The readings expected at theta (P,), and what belongs to them. The lag begins where the first reading `first_ppm` was."""
    t, q, at, element = path
    k, n, m, width = len(t), q.shape[1], len(at), LAW + 2 * q.shape[1]
    elements = (len(theta) - width - 1) // 2
    gains, offsets, factor = np.exp(theta[width : width + elements]), theta[width + elements + 1 :], np.exp(theta[width + elements])
    h, rows, gain, along = np.empty(m), np.zeros((m if want_rows else 0, len(theta))), np.empty(m), np.empty((6, k))
    grad = np.empty((k if want_rows else BLOCK, LAW + n))
    _field_along_path(theta, t, q, chain, law, along, grad, want_rows)
    e = element[0]
    start = max((first_ppm - offsets[e]) / gains[e], 0.0)
    f, df_tau, left, reading = start, 0.0, 1.0, 0
    before, df = np.empty(width), np.zeros(width)
    for i in range(k):
        c, dt = along[0, i], along[4, i]
        c0 = along[0, max(i - 1, 0)]
        tau = factor * (lag.rise_s if c > f else lag.fall_s)
        along[5, i] = tau
        phi, share, to_phi = lag_step(dt, tau)
        w0, w1 = share - phi, 1.0 - share
        df_tau = phi * df_tau + f * to_phi - c * w0 + c0 * (w0 - to_phi)
        f = phi * f + w0 * c0 + w1 * c
        left *= phi if i > 0 else 1.0
        if want_rows:
            _lag_derivatives(df, before, grad[i], c, 0.5 * t[i] * t[i], phi, w0, w1, n, i == 0)
        while reading < m and at[reading] == i:
            g = gains[element[reading]]
            h[reading], gain[reading] = g * f, g
            if want_rows:
                _store_derivatives(rows[reading], df, g, g * f, g * df_tau, element[reading], elements)
                if start > 0.0:  # of the lag's beginning (z_0 - b) / g so much is left
                    rows[reading, width + elements + 1 + e] -= g * left / gains[e]
                    rows[reading, width + e] -= g * left * start
            reading += 1
    if reading < m:
        raise ValueError("readings must lie on the path, in the order of time")
    return ExpectedPath(h, rows, gain, along, f)


@compiled
def _store_derivatives(row: Array, df: Array, gain: float, h: float, by_tau: float, element: int, elements: int) -> None:
    """A reading's derivatives (P,): by the law and the joints as `df` (width,) says, by the lag, by its element's gain and offset."""
    width = len(df)
    for j in range(width):
        row[j] = gain * df[j]
    row[width + elements] = by_tau
    row[width + element] += h
    row[width + elements + 1 + element] += 1.0


@compiled
def _field_along_path(
    theta: Array, t: Array, q: Array, chain: AdjointChain, law: LawScale, along: Array, grad: Array, want_rows: bool
) -> None:
    """The first five rows of `along`, and the derivative of ln c by the law and by the joints' offsets (k, LAW + n), if wanted."""
    k, n = q.shape
    joints, turned, p = np.empty((n, BLOCK)), np.empty((n, ROWS, BLOCK)), np.empty((3, BLOCK))
    slope, by_q = np.empty((3, BLOCK)), np.empty((n, BLOCK))
    x0, y0, z0 = 0.0, 0.0, 0.0
    for begin in range(0, k, BLOCK):
        here = min(BLOCK, k - begin)
        for b in range(BLOCK):
            i = min(begin + b, k - 1)  # the last block is filled up with the last point
            for j in range(n):
                joints[j, b] = q[i, j] - theta[LAW + j] - 0.5 * t[i] * t[i] * theta[LAW + n + j]
        forward_positions(joints, chain, turned, p)
        for b in range(here):
            i = begin + b
            x, y, z, dt = p[0, b], p[1, b], p[2, b], t[i] - t[max(i - 1, 0)]
            if i == 0:
                x0, y0, z0 = x, y, z
            row = grad[i if want_rows else b]
            along[0, i], along[2, i], along[1, i] = concentration_at(
                x - theta[SX], y - theta[SY], z - theta[SZ], theta, law.r_ref_m, law.radius_m, row
            )
            slope[0, b], slope[1, b], slope[2, b] = row[SX], row[SY], row[SZ]
            along[3, i] = np.sqrt((x - x0) ** 2 + (y - y0) ** 2 + (z - z0) ** 2) / max(dt, 1e-9)
            along[4, i] = dt
            x0, y0, z0 = x, y, z
        if want_rows:
            gradient_by_joints(slope, chain, turned, by_q)  # d ln c / d o = grad_s . J: p falls as o grows
            for b in range(here):
                for j in range(n):
                    grad[begin + b, LAW + j] = by_q[j, b]


@compiled
def lag_step(dt: float, tau: float) -> tuple[float, float, float]:
    """phi, (1 - phi) tau / dt = w0 + phi = 1 - w1, and d phi / d ln(tau) of one step."""
    x = max(dt, 1e-9) / tau
    phi = np.exp(-x)
    return phi, (1.0 - phi) / x if x > 1e-6 else 1.0 - 0.5 * x, phi * x


@compiled
def _lag_derivatives(
    df: Array, before: Array, grad: Array, c: float, half_t2: float, phi: float, w0: float, w1: float, n: int, first: bool
) -> None:
    """df follows dc = c grad as f follows c; `before` is dc one step earlier. The drift of a joint is its offset, t^2 / 2 times."""
    size = len(grad)
    for j in range(size):
        dc = c * grad[j]
        df[j] = phi * df[j] + w0 * (dc if first else before[j]) + w1 * dc
        before[j] = dc
    for j in range(n):
        dc = c * half_t2 * grad[LAW + j]
        df[size + j] = phi * df[size + j] + w0 * (dc if first else before[size + j]) + w1 * dc
        before[size + j] = dc
