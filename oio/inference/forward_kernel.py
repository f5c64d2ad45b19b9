"""Compiled forward model: one pass along a path, from joints over nose position, mean field and sensor lag to the predicted readings.

The lag is first order, the concentration c linear in each step (first-order hold): f_i = phi f_{i-1} + w0 c_{i-1} + w1 c_i,
phi = exp(-dt_i / tau), w1 = 1 - (1 - phi) tau / dt, w0 = 1 - phi - w1; tau is `rise` or `fall` by the sign of c_i - f_{i-1}.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from oio.core.compiled import compiled
from oio.core.records import Array
from oio.gas.range_law import KX, KY, KZ, LAW, SX, SY, SZ, concentration_at
from oio.gas.source_shape import against_nose
from oio.inference.extension_kernel import Knots, LawScale, extended_field, knot_weights, law_at, parameters_of_law
from oio.kinematics.adjoint import BLOCK, ROWS, AdjointChain, forward_positions, gradient_by_joints


class SensedPath(NamedTuple):
    """Joint path and the readings on it."""

    t_s: Array  # (k,)
    q: Array  # (k, n) rad
    at: NDArray[np.int64]  # (m,), path index of each reading
    element: NDArray[np.int64]  # (m,), element of each reading


class Lag(NamedTuple):
    """Time constants of the sensor's first-order lag."""

    rise_s: float
    fall_s: float


class ExpectedPath(NamedTuple):
    """Result of `predict_readings`."""

    ppm: Array  # (m,), predicted readings without offsets
    rows: Array  # (m, P), their Jacobian by theta, including the offsets; (0, P) if not requested
    gain: Array  # (m,), gain of each reading's element
    along: Array  # (9, k): c [ppm], rarity, r [m], speed of the nose [m/s], dt [s], tau [s], derivative of ln c by the wind (3) [m]
    lagged_ppm: float  # lagged concentration at the end of the path


@compiled
def predict_readings(
    theta: Array, path: SensedPath, first_ppm: float, chain: AdjointChain, law: LawScale, lag: Lag, knots: Knots, want_rows: bool
) -> ExpectedPath:
    """Predict the readings at theta (P,), with Jacobian and field along the path. The first reading `first_ppm` initialises the lag, which
    begins there."""
    t, q, at, element = path
    k, n, m, width = len(t), q.shape[1], len(at), LAW + 2 * q.shape[1]
    of_field, of_background = parameters_of_law(knots) + knots.joints, max(len(knots.background_s) - 1, 0)
    size = len(theta) - of_field - of_background  # without the extension
    elements = (size - width - 1) // 2
    gains, offsets, factor = np.exp(theta[width : width + elements]), theta[width + elements + 1 : size], np.exp(theta[width + elements])
    h, rows, gain, along = np.empty(m), np.zeros((m if want_rows else 0, len(theta))), np.empty(m), np.empty((9, k))
    grad = np.empty((k if want_rows else BLOCK, LAW + n + of_field))
    _field_along_path(theta, t, q, chain, law, (knots, size), along, grad, want_rows)
    e, begin = element[0], at[0]
    initial = max((first_ppm - offsets[e]) / gains[e], 0.0)
    f, df_tau, remaining, reading = initial, 0.0, 1.0, 0
    previous, df = np.empty(width + of_field), np.zeros(width + of_field)
    along[5, :begin] = factor * lag.rise_s
    for i in range(begin, k):
        c, dt = along[0, i], along[4, i] if i > begin else 0.0
        c0 = along[0, max(i - 1, begin)]
        tau = factor * (lag.rise_s if c > f else lag.fall_s)
        along[5, i] = tau
        phi, share, to_phi = lag_step(dt, tau)
        w0, w1 = share - phi, 1.0 - share
        df_tau = phi * df_tau + f * to_phi - c * w0 + c0 * (w0 - to_phi)
        f = phi * f + w0 * c0 + w1 * c
        remaining *= phi if i > begin else 1.0
        if want_rows:
            _lag_derivatives(df, previous, grad[i], c, 0.5 * t[i] * t[i], phi, w0, w1, n, i == begin)
        while reading < m and at[reading] == i:
            g = gains[element[reading]]
            h[reading], gain[reading] = g * f, g
            if want_rows:
                _store_derivatives(rows[reading], df, g, g * f, g * df_tau, element[reading], (width, elements))
                if initial > 0.0:  # share of the lag's initial state (z_0 - b) / g that remains
                    rows[reading, width + elements + 1 + e] -= g * remaining / gains[e]
                    rows[reading, width + e] -= g * remaining * initial
            if of_background:
                for j, weight in knot_weights(knots.background_s, t[i]):
                    h[reading] += g * weight * theta[size + of_field + j]
                    if want_rows:
                        rows[reading, size + of_field + j] += g * weight
            reading += 1
    if reading < m:
        raise ValueError("readings must lie on the path, in the order of time")
    return ExpectedPath(h, rows, gain, along, f)


@compiled
def _store_derivatives(row: Array, df: Array, gain: float, h: float, by_tau: float, element: int, layout: tuple[int, int]) -> None:
    """Fill the Jacobian row (P,) of a reading: law and joints from `df`, then lag, gain and offset of its element, and the extension."""
    width, elements = layout
    for j in range(width):
        row[j] = gain * df[j]
    for j in range(width, len(df)):
        row[2 * elements + 1 + j] = gain * df[j]
    row[width + elements] = by_tau
    row[width + element] += h
    row[width + elements + 1 + element] += 1.0


@compiled
def _field_along_path(
    theta: Array, t: Array, q: Array, chain: AdjointChain, law: LawScale, extension: tuple[Knots, int], along: Array, grad: Array,
    want_rows: bool,
) -> None:  # fmt: skip
    """Fill the first five rows of `along`, and if requested the derivative of ln c by law, joint offsets and extension (k, LAW + n + X)."""
    k, n = q.shape
    knots, base = extension
    extended, at_t, more = grad.shape[1] > LAW + n, np.empty(LAW), np.empty(LAW)
    joints, frames, p = np.empty((n, BLOCK)), np.empty((n, ROWS, BLOCK)), np.empty((3, BLOCK))
    gradient, by_q = np.empty((3, BLOCK)), np.empty((n, BLOCK))
    drift = base + parameters_of_law(knots)  # index of the additional drift of the first joint
    x0, y0, z0 = 0.0, 0.0, 0.0
    for begin in range(0, k, BLOCK):
        count = min(BLOCK, k - begin)
        for b in range(BLOCK):
            i = min(begin + b, k - 1)  # the last block is padded with the last point
            for j in range(n):
                joints[j, b] = q[i, j] - theta[LAW + j] - 0.5 * t[i] * t[i] * theta[LAW + n + j]
                if knots.joints:
                    joints[j, b] -= 0.5 * (t[i] - t[0]) ** 2 * theta[drift + j]
        forward_positions(joints, chain, frames, p)
        for b in range(count):
            i = begin + b
            x, y, z, dt = p[0, b], p[1, b], p[2, b], t[i] - t[max(i - 1, 0)]
            if i == 0:
                x0, y0, z0 = x, y, z
            row = grad[i if want_rows else b]
            if not extended:
                along[0, i], along[2, i], along[1, i] = concentration_at(
                    x - theta[SX], y - theta[SY], z - theta[SZ], theta, law.r_ref_m, law.radius_m, row
                )
                gradient[0, b], gradient[1, b], gradient[2, b] = row[SX], row[SY], row[SZ]
            else:
                law_at(theta, knots, base, t[i], at_t)
                field = concentration_at(x - at_t[SX], y - at_t[SY], z - at_t[SZ], at_t, law.r_ref_m, law.radius_m, row)
                along[0, i], along[2, i], along[1, i] = extended_field(
                    theta, knots, base, t[i], (x, y, z), at_t, law, field, row, row[LAW + n :], more
                )
                for a in range(3):
                    gradient[a, b] = against_nose(knots.source, row, row[LAW + n :], a)
            along[6, i], along[7, i], along[8, i] = row[KX], row[KY], row[KZ]
            along[3, i] = np.sqrt((x - x0) ** 2 + (y - y0) ** 2 + (z - z0) ** 2) / max(dt, 1e-9)
            along[4, i] = dt
            x0, y0, z0 = x, y, z
        if want_rows:
            gradient_by_joints(gradient, chain, frames, by_q)  # d ln c / d o = grad_s . J: p falls as o grows
            for b in range(count):
                for j in range(n):
                    grad[begin + b, LAW + j] = by_q[j, b]
                    if knots.joints:
                        grad[begin + b, LAW + n + drift - base + j] = 0.5 * (t[begin + b] - t[0]) ** 2 * by_q[j, b]


@compiled
def lag_step(dt: float, tau: float) -> tuple[float, float, float]:
    """Discretised lag of one step: phi, (1 - phi) tau / dt = w0 + phi = 1 - w1, and d phi / d ln(tau)."""
    x = max(dt, 1e-9) / tau
    phi = np.exp(-x)
    return phi, (1.0 - phi) / x if x > 1e-6 else 1.0 - 0.5 * x, phi * x


@compiled
def _lag_derivatives(
    df: Array, previous: Array, grad: Array, c: float, half_t2: float, phi: float, w0: float, w1: float, n: int, first: bool
) -> None:
    """Lag the derivatives: df follows dc = c grad as f follows c; `previous`: dc one step earlier. Drift acts as t^2 / 2 times offset."""
    size = LAW + n
    for j in range(len(grad)):
        dc, i = c * grad[j], j if j < size else j + n
        df[i] = phi * df[i] + w0 * (dc if first else previous[i]) + w1 * dc
        previous[i] = dc
    for j in range(n):
        dc = c * half_t2 * grad[LAW + j]
        df[size + j] = phi * df[size + j] + w0 * (dc if first else previous[size + j]) + w1 * dc
        previous[size + j] = dc
