"""How gas fluctuates about its mean, and readings made independent of each other by that.

The gas at the nose is c (1 + h m): m an Ornstein-Uhlenbeck process of variance gamma^2 and correlation time r / (r_ref / T + v), because an
eddy as wide as the plume there passes with the gas's own speed and the nose's v. h^2 = I + (n u_p / gamma r)^2: I is the rarity of the
plume there (a plume that is there a fraction p of the time has variance mean^2 (1/p - 1)), and u_p, how well the kinematics know where the
nose is from one moment to the next (free play), counts the more the nearer the source is. The sensor's lag smooths it, white noise is
added. So the deviation of the readings from their mean is a linear process of two states, the lagged deviation and m; a Kalman filter with frozen gains turns residuals into independent ones of variance
one, and their Jacobians with them (innovations form of the likelihood, Schweppe 1965).
"""

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from oio.records import Array


@dataclass(frozen=True, slots=True)
class Fluctuation:
    """scale: variance of the white noise over the sensor's nominal one; gamma and t_s (at r_ref) of the gas."""

    scale: float
    gamma: float
    t_s: float

    def height(self, rarity: Array, slope_m: float, r_m: Array) -> Array:
        """h (k,): how much more than gamma the gas fluctuates at distances r (k,) m; slope_m is n u_p."""
        return np.asarray(np.sqrt(rarity + (slope_m / (self.gamma * r_m)) ** 2))

    def rate(self, r_m: Array, speed_m_s: Array, r_ref_m: float) -> Array:
        """1 / correlation time (k,) 1/s at distances r (k,) m for a nose moving with speed v (k,) m/s."""
        return np.asarray((r_ref_m / self.t_s + speed_m_s) / r_m)


@dataclass(frozen=True, slots=True, eq=False)
class Along:
    """What the mean field is along the path: dt (k,) s, lag factor phi (k,), mean c (k,) ppm, rarity I (k,), n u_p [m],
    distance r (k,) m, speed v of the nose (k,) m/s; and of every reading its place on the path (m,), gain (m,) and nominal variance (m,) ppm^2."""

    dt_s: Array
    phi: Array
    mean_ppm: Array
    rarity: Array
    slope_m: float
    r_m: Array
    speed_m_s: Array
    r_ref_m: float
    at: NDArray[np.int64]
    gain: Array
    variance_ppm2: Array


@dataclass(frozen=True, slots=True, eq=False)
class White:
    """Rows made independent (m, p), and the variances that the filter expected (m,) ppm^2."""

    rows: Array
    expected_ppm2: Array

    @property
    def minus_2_log_likelihood(self) -> float:
        """-2 ln L of the first column as residuals, up to a constant."""
        return float(self.rows[:, 0] @ self.rows[:, 0] + np.sum(np.log(self.expected_ppm2)))


def whiten(rows: Array, along: Along, noise: Fluctuation) -> White:
    """Rows (m, p) (residuals, Jacobians; all in ppm) through the whitening filter."""
    keep = np.exp(-along.dt_s * noise.rate(along.r_m, along.speed_m_s, along.r_ref_m))
    out, expected = _filtered(
        np.ascontiguousarray(rows),
        along.at,
        along.phi,
        along.mean_ppm * noise.height(along.rarity, along.slope_m, along.r_m),
        keep,
        noise.gamma**2,
        along.gain,
        noise.scale * along.variance_ppm2,
    )
    return White(out, expected)


GAMMAS = np.geomspace(0.02, 1.5, 14)
TIMES_S = np.geomspace(0.1, 10.0, 10)


def fitted(residual: Array, along: Along, scale: float) -> Fluctuation:
    """gamma and T of greatest likelihood of the residuals (m,) of a fit, on a grid; `scale` is that of the baseline."""
    choices = [Fluctuation(scale, float(g), float(t)) for g in GAMMAS for t in TIMES_S]
    return min(choices, key=lambda noise: whiten(residual[:, None], along, noise).minus_2_log_likelihood)


@numba.njit(cache=True)
def _filtered(
    rows: Array, at: NDArray[np.int64], phi: Array, swing: Array, keep: Array, variance: float, gain: Array, white: Array
) -> tuple[Array, Array]:
    m, p = rows.shape
    out, expected = np.empty((m, p)), np.empty(m)
    lagged, relative = np.zeros(p), np.zeros(p)  # state estimates, one per column
    p00, p01, p11 = 0.0, 0.0, variance
    step = 0
    for i in range(m):
        while step <= at[i]:
            a, b, k = phi[step], (1.0 - phi[step]) * swing[step], keep[step]
            p00, p01, p11 = (
                a * a * p00 + 2.0 * a * b * p01 + b * b * p11,
                k * (a * p01 + b * p11),
                k * k * p11 + variance * (1.0 - k * k),
            )
            for j in range(p):
                lagged[j] = a * lagged[j] + b * relative[j]
                relative[j] *= k
            step += 1
        g = gain[i]
        s = g * g * p00 + white[i]
        k0, k1, root = g * p00 / s, g * p01 / s, np.sqrt(s)
        expected[i] = s
        for j in range(p):
            innovation = rows[i, j] - g * lagged[j]
            out[i, j] = innovation / root
            lagged[j] += k0 * innovation
            relative[j] += k1 * innovation
        p00, p01, p11 = p00 - k0 * g * p00, p01 - k0 * g * p01, p11 - k1 * g * p01
    return out, expected
