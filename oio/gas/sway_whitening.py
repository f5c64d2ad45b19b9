"""Whitening of readings in a plume that sways: the filter of `oio.gas.whitening` with three more states, the sway.

The concentration at the nose is c (1 + h m + g.q), see `oio.gas.fluctuation`: q (3,) is the same at every place, and g points away from
the source, so that what a sway adds on one side it takes away on the other. States: lagged deviation f [ppm], then m and q.
"""

import numpy as np
from numpy.typing import NDArray

from oio.core.compiled import compiled
from oio.core.records import Array
from oio.gas.fluctuation import MeanField, lagged_ou_step

AXES = 3
SOURCES = 1 + AXES  # what drives the lagged deviation: m, and q along each axis


def sway_height(field: MeanField) -> Array:
    """What a sway of 1 along each axis adds to the concentration, c g (k, 3) [ppm]."""
    return np.ascontiguousarray((field.mean_ppm / field.r_m)[:, None] * field.by_wind_m)


@compiled
def sway_steps(dt: Array, tau: Array, sway: float, sway_s: float) -> Array:
    """`lagged_ou_steps` (k, 6) of one axis of the sway, for an amplitude of 1 ppm."""
    out = np.empty((len(dt), 6))
    for i in range(len(dt)):
        keep = np.exp(-dt[i] / sway_s)
        lagged_ou_step(np.exp(-dt[i] / tau[i]), keep, dt[i], tau[i], sway_s, 1.0, sway * sway, out[i])
    return out


@compiled
def sway_filter(
    rows: Array, at: NDArray[np.int64], steps: Array, sway: Array, height: Array, variances: tuple[float, float], gain: Array, white: Array
) -> tuple[Array, Array]:
    """Whitened rows (m, p) and innovation variances (m,). `steps`, `sway` (k, 6): of m and of one axis of q; `height` (k, 3) [ppm]: c g;
    `variances`: of m and of one axis of q; `white` (m,): white noise of the readings."""
    m, p = rows.shape
    out, expected = np.empty((m, p)), np.empty(m)
    lagged, state = np.zeros(p), np.zeros((SOURCES, p))
    pff, pf, pp = (
        white[0] / (gain[0] * gain[0]),
        np.zeros(SOURCES),
        np.zeros((SOURCES, SOURCES)),
    )  # covariance: f f, f with m and q, m and q
    pp[0, 0] = variances[0]
    for a in range(1, SOURCES):
        pp[a, a] = variances[1]
    work, along, kept, gains = np.empty((4, SOURCES)), np.empty(SOURCES), np.empty(SOURCES), np.empty(SOURCES)
    out[0], expected[0] = 0.0, 1.0  # the first reading initialises the lag: see `whitening_filter`
    step = at[0] + 1
    for i in range(1, m):
        f = 1.0  # transition over all steps since the last reading, applied once per column
        along[:], kept[:] = 0.0, 1.0
        while step <= at[i]:
            pff = _advance(pff, pf, pp, steps[step], sway[step], height[step], work)
            f *= steps[step, 0]
            for x in range(SOURCES):
                along[x] = steps[step, 0] * along[x] + work[0, x] * kept[x]
                kept[x] *= work[1, x]
            step += 1
        pff = max(pff, 0.0)
        g = gain[i]
        s = g * g * pff + white[i]
        k0, sd = g * pff / s, np.sqrt(s)
        for x in range(SOURCES):
            gains[x] = g * pf[x] / s
        expected[i] = s
        for j in range(p):
            predicted = f * lagged[j]
            for x in range(SOURCES):
                predicted += along[x] * state[x, j]
            innovation = rows[i, j] - g * predicted
            out[i, j] = innovation / sd
            lagged[j] = predicted + k0 * innovation
            for x in range(SOURCES):
                state[x, j] = kept[x] * state[x, j] + gains[x] * innovation
        pff = _condition(pff, pf, pp, gains, g, white[i] / s)
    return out, expected


@compiled
def _advance(pff: float, pf: Array, pp: Array, step: Array, sway: Array, height: Array, work: Array) -> float:
    """One step, P = F P F' + Q in place; returns the variance of f, and in `work` (4, SOURCES) the rows of F (couplings, decays)."""
    b, keep, q01, cross = work[0], work[1], work[2], work[3]
    phi, q00 = step[0], step[3]
    b[0], keep[0], q01[0] = step[1], step[2], step[4]
    for a in range(AXES):
        h = height[a]
        b[1 + a], keep[1 + a], q01[1 + a] = h * sway[1], sway[2], h * sway[4]
        q00 += h * h * sway[3]
    total = phi * phi * pff + q00
    for x in range(SOURCES):
        by_others = 0.0
        for y in range(SOURCES):
            by_others += b[y] * pp[y, x]
        total += b[x] * (2.0 * phi * pf[x] + by_others)
        cross[x] = phi * pf[x] + by_others
    for x in range(SOURCES):
        pf[x] = keep[x] * cross[x] + q01[x]
        for y in range(SOURCES):
            pp[x, y] *= keep[x] * keep[y]
    pp[0, 0] += step[5]
    for a in range(1, SOURCES):
        pp[a, a] += sway[5]
    return float(total)


@compiled
def _condition(pff: float, pf: Array, pp: Array, gains: Array, g: float, left: float) -> float:
    """Covariance after a reading, in place; returns the variance of f. `left` is 1 - g k, without a difference of equal numbers."""
    for x in range(SOURCES):
        for y in range(SOURCES):
            pp[x, y] -= gains[x] * g * pf[y]
        pp[x, x] = max(pp[x, x], 0.0)
    for x in range(SOURCES):
        most = np.sqrt(left * pff * pp[x, x])
        pf[x] = min(max(left * pf[x], -most), most)
    return float(pff * left)
