"""Whitening of readings in a plume that meanders: the filter of `oio.gas.whitening` with three more states, the meander of the wind.

A plume sways as a whole (Gifford 1959, Adv. Geophys. 6:117): where it is too strong on one side of the source, it is too weak on the other.
The wind k of the range law is k + q, with q (3,) [1/m] Ornstein-Uhlenbeck processes of one variance and correlation time, the same at every
place, and the concentration changes by c (d ln c / d k) . q. So a nose that moves about the source does not see independent errors.
"""

import numpy as np
from numpy.typing import NDArray

from oio.core.compiled import compiled
from oio.core.records import Array
from oio.gas.fluctuation import MeanField, lagged_ou_step

SWAY = 3


def sway_height(field: MeanField) -> Array:
    """What a unit of sway changes of the concentration (k, 3) [ppm]."""
    return np.asarray((field.mean_ppm / field.r_m)[:, None] * field.by_wind_m)


@compiled
def sway_steps(dt: Array, tau: Array, sway: float, sway_s: float) -> Array:
    """`lagged_ou_steps` (k, 6) of a meander of unit height, in which a component of the wind acts on the lagged concentration."""
    out = np.empty((len(dt), 6))
    for i in range(len(dt)):
        keep = np.exp(-dt[i] / sway_s)
        lagged_ou_step(np.exp(-dt[i] / tau[i]), keep, dt[i], tau[i], sway_s, 1.0, sway * sway, out[i])
    return out


@compiled
def sway_filter(
    rows: Array, at: NDArray[np.int64], steps: Array, sway: Array, height: Array, variances: tuple[float, float], gain: Array, white: Array
) -> tuple[Array, Array]:
    """Whitened rows (m, p) and innovation variances (m,). `steps`, `sway` (k, 6): of fluctuation and meander; `height` (k, 3) [ppm m]:
    c (d ln c / d k); `variances`: of the fluctuation and of a component of the meander; `white` (m,): white noise of the readings."""
    m, p = rows.shape
    n = 1 + SWAY
    out, expected = np.empty((m, p)), np.empty(m)
    lagged, state = np.zeros(p), np.zeros((n, p))
    pff, pf, pp = white[0] / (gain[0] * gain[0]), np.zeros(n), np.zeros((n, n))
    pp[0, 0] = variances[0]
    for a in range(1, n):
        pp[a, a] = variances[1]
    b, keep, q01, along, kept, gains = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    out[0], expected[0] = 0.0, 1.0
    step = at[0] + 1
    for i in range(1, m):
        f = 1.0
        along[:], kept[:] = 0.0, 1.0
        while step <= at[i]:
            phi, q00 = steps[step, 0], steps[step, 3]
            b[0], keep[0], q01[0] = steps[step, 1], steps[step, 2], steps[step, 4]
            for a in range(SWAY):
                h = height[step, a]
                b[1 + a], keep[1 + a], q01[1 + a] = h * sway[step, 1], sway[step, 2], h * sway[step, 4]
                q00 += h * h * sway[step, 3]
            total = phi * phi * pff + q00
            for x in range(n):
                cross = 0.0
                for y in range(n):
                    cross += b[y] * pp[y, x]
                total += b[x] * (2.0 * phi * pf[x] + cross)
                gains[x] = phi * pf[x] + cross
            pff = total
            for x in range(n):
                pf[x] = keep[x] * gains[x] + q01[x]
                for y in range(n):
                    pp[x, y] *= keep[x] * keep[y]
            pp[0, 0] += steps[step, 5]
            for a in range(1, n):
                pp[a, a] += sway[step, 5]
            f *= phi
            for x in range(n):
                along[x] = phi * along[x] + b[x] * kept[x]
                kept[x] *= keep[x]
            step += 1
        pff = max(pff, 0.0)
        g = gain[i]
        s = g * g * pff + white[i]
        k0, sd = g * pff / s, np.sqrt(s)
        for x in range(n):
            gains[x] = g * pf[x] / s
        expected[i] = s
        for j in range(p):
            predicted = f * lagged[j]
            for x in range(n):
                predicted += along[x] * state[x, j]
            innovation = rows[i, j] - g * predicted
            out[i, j] = innovation / sd
            lagged[j] = predicted + k0 * innovation
            for x in range(n):
                state[x, j] = kept[x] * state[x, j] + gains[x] * innovation
        left = white[i] / s  # 1 - g k0, without a difference of equal numbers
        for x in range(n):
            for y in range(n):
                pp[x, y] -= gains[x] * g * pf[y]
            pp[x, x] = max(pp[x, x], 0.0)
        for x in range(n):
            most = np.sqrt(left * pff * pp[x, x])
            pf[x] = min(max(left * pf[x], -most), most)
        pff *= left
    return out, expected
