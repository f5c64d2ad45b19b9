"""Whitening of readings: residuals and Jacobians made independent of each other by a Kalman filter over lag and fluctuation.

White noise is added to the lagged fluctuation of `oio.gas.fluctuation`. A Kalman filter over those two states with frozen gains turns
residuals and their Jacobians into independent innovations of unit variance (innovations form of the likelihood, Schweppe 1965).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oio.core.compiled import compiled
from oio.core.records import Array
from oio.gas.fluctuation import Fluctuation, PathField, fluctuation_ppm, lagged_ou_step
from oio.gas.pair_whitening import PairWhitening
from oio.gas.sway_whitening import sway_filter, sway_height, sway_steps


@dataclass(frozen=True, slots=True, eq=False)
class Whitened:
    """Whitened rows (m, p), and the innovation variances of the filter (m,) [ppm^2]."""

    rows: Array
    expected_ppm2: Array

    @property
    def minus_2_log_likelihood(self) -> float:
        """-2 ln L up to a constant; the first column holds the whitened residuals."""
        return float(self.rows[:, 0] @ self.rows[:, 0] + np.sum(np.log(self.expected_ppm2)))


def whiten(rows: Array, along: PathField, noise: Fluctuation) -> Whitened:
    """Whiten rows (m, p) (residuals, Jacobians; all in ppm) by the filter of one path."""
    return Whitening(along, noise).of(rows, along.variance_ppm2)


class Whitening:
    """Whitening filter of one path, built once and applied to rows and reading variances given later."""

    def __init__(self, along: PathField, noise: Fluctuation) -> None:
        self._along, self._noise, self._pair = along, noise, None if along.second is None else PairWhitening(along, noise)
        if self._pair is not None:
            return
        f = along.field
        numbers = (f.slope_m, f.model_discrepancy, f.r_ref_m, noise.gamma, noise.t_s)
        self._steps = lagged_ou_path(f.mean_ppm, f.rarity, f.r_m, f.speed_m_s, along.dt_s, along.tau_s, numbers)
        self._sway = (sway_steps(along.dt_s, along.tau_s, noise.sway, noise.sway_s), sway_height(f)) if noise.sway > 0.0 else None

    def of(self, rows: Array, variance_ppm2: Array) -> Whitened:
        """Whiten rows (m, p) [ppm] of readings with nominal variance (m,) [ppm^2]."""
        white, along, noise = self._noise.scale * variance_ppm2, self._along, self._noise
        if self._pair is not None:
            return Whitened(*self._pair.of(np.ascontiguousarray(rows), white))
        if self._sway is not None:
            variances = noise.gamma**2, noise.sway**2
            return Whitened(*sway_filter(np.ascontiguousarray(rows), along.at, self._steps, *self._sway, variances, along.gain, white))
        return Whitened(*whitening_filter(np.ascontiguousarray(rows), along.at, self._steps, noise.gamma**2, along.gain, white))


@compiled
def lagged_ou_path(
    mean: Array, rarity: Array, r: Array, speed: Array, dt: Array, tau: Array, numbers: tuple[float, float, float, float, float]
) -> Array:
    """`lagged_ou_steps` of a field, with `height` and `rate` of its fluctuation."""
    slope, w, r_ref, gamma, t_s = numbers
    out = np.empty((len(dt), 6))
    for i in range(len(dt)):
        amplitude, t = fluctuation_ppm(mean[i], rarity[i], r[i], slope, w, r_ref, gamma), r[i] / (r_ref / t_s + speed[i])
        lagged_ou_step(np.exp(-dt[i] / tau[i]), np.exp(-dt[i] / t), dt[i], tau[i], t, amplitude, gamma * gamma, out[i])
    return out


@compiled
def whitening_filter(rows: Array, at: NDArray[np.int64], steps: Array, variance: float, gain: Array, white: Array) -> tuple[Array, Array]:
    """Whitened rows (m, p) and innovation variances (m,); `variance`: of the fluctuation, `white` (m,): white noise of the readings."""
    m, p = rows.shape
    out, expected = np.empty((m, p)), np.empty(m)
    lagged, relative = np.zeros(p), np.zeros(p)  # state estimates, one per column
    # the first reading initialises the lag: it carries no further information, and the state has the variance of a reading
    p00, p01, p11 = white[0] / (gain[0] * gain[0]), 0.0, variance
    out[0], expected[0] = 0.0, 1.0
    step = at[0] + 1
    for i in range(1, m):
        f00, f01, f11 = 1.0, 0.0, 1.0  # transition over all steps since the last reading, applied once per column
        while step <= at[i]:
            a, b, k = steps[step, 0], steps[step, 1], steps[step, 2]
            f00, f01, f11 = a * f00, a * f01 + b * f11, k * f11
            p00, p01, p11 = (
                a * a * p00 + 2.0 * a * b * p01 + b * b * p11 + steps[step, 3],
                k * (a * p01 + b * p11) + steps[step, 4],
                k * k * p11 + steps[step, 5],
            )
            step += 1
        p00, p11 = max(p00, 0.0), max(p11, 0.0)  # a fluctuation of 1e8 times the noise leaves no digits after the subtraction
        if p01 * p01 > p00 * p11:
            p01 = np.copysign(np.sqrt(p00 * p11), p01)
        g = gain[i]
        s = g * g * p00 + white[i]
        k0, k1, sd = g * p00 / s, g * p01 / s, np.sqrt(s)
        expected[i] = s
        for j in range(p):
            f, r = f00 * lagged[j] + f01 * relative[j], f11 * relative[j]
            innovation = rows[i, j] - g * f
            out[i, j] = innovation / sd
            lagged[j] = f + k0 * innovation
            relative[j] = r + k1 * innovation
        p00, p01, p11 = p00 - k0 * g * p00, p01 - k0 * g * p01, p11 - k1 * g * p01
    return out, expected
