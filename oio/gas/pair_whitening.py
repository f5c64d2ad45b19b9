"""Whitening of the readings of two elements at two places: the filter of `oio.gas.whitening` with four states, f and m at either place.

The two fluctuations are correlated, see `oio.gas.fluctuation`. Each element's first reading initialises its own lag.
"""

import numpy as np
from numpy.typing import NDArray

from oio.core.compiled import compiled
from oio.core.records import Array
from oio.gas.fluctuation import Fluctuation, MeanField, PathField, fluctuation_ppm, lagged_ou_cross, lagged_ou_step, with_sway

STEP = 16  # numbers of a step: six of `lagged_ou_step` for either place, four of `lagged_ou_cross`


class PairWhitening:
    """Whitening filter of one path with two places."""

    def __init__(self, along: PathField, noise: Fluctuation) -> None:
        assert along.second is not None
        self._along, self._variance, second = along, noise.gamma**2, along.second
        one, other = _path(along.field, along.tau_s), _path(second.field, second.tau_s)
        f = along.field
        numbers = (f.slope_m, f.model_discrepancy, f.r_ref_m, noise.gamma, noise.t_s, noise.sway, noise.sway_s)
        self._steps = _pair_path(one, other, along.dt_s, second.spacing_m, numbers)
        self._place = second.is_second.astype(np.int64)
        self._rho = float(np.exp(-2.0 * second.spacing_m / (f.r_m[0] + second.field.r_m[0])))

    def of(self, rows: Array, white: Array) -> tuple[Array, Array]:
        """Whitened rows (m, p) of rows [ppm], and innovation variances (m,); `white` (m,) [ppm^2]: variances of the readings' own noise."""
        along = self._along
        return pair_filter(rows, along.at, self._place, self._steps, (self._variance, self._rho), along.gain, white)


def _path(f: MeanField, tau_s: Array) -> Array:
    return np.stack([f.mean_ppm, f.rarity, f.r_m, f.speed_m_s, tau_s, np.sqrt(np.sum(np.square(f.by_wind_m), axis=1))])


@compiled
def _pair_path(
    one: Array, other: Array, dt: Array, spacing: float, numbers: tuple[float, float, float, float, float, float, float]
) -> Array:
    """Steps (k, STEP) of a path; `one`, `other` (6, k): mean, rarity, r, speed, tau and |d ln c / d k| at either place."""
    slope, w, r_ref, gamma, t_s, sway, sway_s = numbers
    variance = gamma * gamma
    out, tau, t, swing = np.empty((len(dt), STEP)), np.empty(2), np.empty(2), np.empty(2)
    for i in range(len(dt)):
        for e in range(2):
            mean, rarity, r, speed, tau[e], by_wind = (one if e == 0 else other)[:, i]
            amplitude, eddy_s = fluctuation_ppm(mean, rarity, r, slope, w, r_ref, gamma), r / (r_ref / t_s + speed)
            swing[e], t[e] = with_sway(amplitude, eddy_s, mean * sway * by_wind / (gamma * r), sway_s)
            step = out[i, 6 * e : 6 * e + 6]
            lagged_ou_step(np.exp(-dt[i] / tau[e]), np.exp(-dt[i] / t[e]), dt[i], tau[e], t[e], swing[e], variance, step)
        rho = np.exp(-2.0 * spacing / (one[2, i] + other[2, i]))
        lagged_ou_cross(out[i, :6], out[i, 6:12], tau, t, swing, variance, rho, out[i, 12:])
    return out


@compiled
def pair_filter(
    rows: Array, at: NDArray[np.int64], place: NDArray[np.int64], steps: Array, fluctuation: tuple[float, float], gain: Array, white: Array
) -> tuple[Array, Array]:
    """Whitened rows (m, p) and innovation variances (m,); states f, f, m, m. `fluctuation`: variance, and correlation at the beginning."""
    m, p = rows.shape
    out, expected, seen = np.zeros((m, p)), np.ones(m), np.zeros(2)
    lagged, relative, cov = np.zeros((2, p)), np.zeros((2, p)), np.zeros((4, 4))
    cov[2, 2] = cov[3, 3] = fluctuation[0]
    cov[2, 3] = cov[3, 2] = fluctuation[0] * fluctuation[1]
    f, step = np.empty((2, 3)), at[0] + 1
    for i in range(m):
        f[:, 0], f[:, 1], f[:, 2] = 1.0, 0.0, 1.0  # transition over all steps since the last reading, applied once per column
        while step <= at[i]:
            _advance(cov, f, steps[step])
            step += 1
        for e in range(2):
            for j in range(p):
                lagged[e, j] = f[e, 0] * lagged[e, j] + f[e, 1] * relative[e, j]
                relative[e, j] *= f[e, 2]
        e, g = place[i], gain[i]
        if seen[e] == 0.0:  # it initialises its lag: the state has the variance of a reading
            seen[e], cov[e, :], cov[:, e], lagged[e, :] = 1.0, 0.0, 0.0, 0.0
            cov[e, e] = white[i] / (g * g)
            continue
        s = g * g * max(cov[e, e], 0.0) + white[i]
        expected[i], k = s, g * cov[e].copy() / s
        for j in range(p):
            innovation = rows[i, j] - g * lagged[e, j]
            out[i, j] = innovation / np.sqrt(s)
            for a in range(2):
                lagged[a, j] += k[a] * innovation
                relative[a, j] += k[2 + a] * innovation
        for a in range(4):
            for b in range(a + 1):
                cov[a, b] -= k[a] * s * k[b]
                cov[b, a] = cov[a, b]
            cov[a, a] = max(cov[a, a], 0.0)
    return out, expected


@compiled
def _advance(cov: Array, f: Array, step: Array) -> None:
    """One step: P = F P F' + Q, and the transition of a column of either place (2, 3) up to here."""
    half, whole = np.empty((4, 4)), np.empty((4, 4))
    for e in range(2):
        a, b, k = step[6 * e], step[6 * e + 1], step[6 * e + 2]
        f[e, 0], f[e, 1], f[e, 2] = a * f[e, 0], a * f[e, 1] + b * f[e, 2], k * f[e, 2]
        half[e], half[2 + e] = a * cov[e] + b * cov[2 + e], k * cov[2 + e]
    for e in range(2):
        a, b, k = step[6 * e], step[6 * e + 1], step[6 * e + 2]
        whole[:, e], whole[:, 2 + e] = a * half[:, e] + b * half[:, 2 + e], k * half[:, 2 + e]
        whole[e, e] += step[6 * e + 3]
        whole[2 + e, 2 + e] += step[6 * e + 5]
        whole[e, 2 + e] += step[6 * e + 4]
        whole[2 + e, e] += step[6 * e + 4]
    whole[0, 1] += step[12]
    whole[1, 0] += step[12]
    whole[0, 3] += step[13]
    whole[3, 0] += step[13]
    whole[2, 1] += step[14]
    whole[1, 2] += step[14]
    whole[2, 3] += step[15]
    whole[3, 2] += step[15]
    cov[:] = whole
