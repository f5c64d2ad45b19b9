"""Concentration fluctuation about the mean field (coloured noise), and the whitening filter that decorrelates readings.

The concentration at the nose is c (1 + h m): m is an Ornstein-Uhlenbeck process of variance gamma^2 and correlation time
r / (r_ref / T + v), because an eddy as wide as the plume passes with the gas's own speed plus the speed v of the nose.
h^2 = I + (n u_p / gamma r)^2 + (w ln(r / r_ref) / gamma)^2:  I is the rarity (intermittency) of the plume (a plume that is present a
fraction p of the time has variance mean^2 (1/p - 1)); u_p is the nose jitter, the short-term uncertainty of the nose position (backlash),
which matters more near the source; w is the model discrepancy of a real plume from the range law per e-fold of distance.

The sensor's lag smooths this and white noise is added. So the deviation of the readings from their mean is a linear process with two
states, the lagged deviation and m; a Kalman filter with frozen gains turns residuals and their Jacobians into independent innovations of
unit variance (innovations form of the likelihood, Schweppe 1965).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oio.core.compiled import compiled
from oio.core.records import Array


@dataclass(frozen=True, slots=True)
class Fluctuation:
    """Noise parameters: `scale`, white-noise variance over the sensor's nominal one; gamma and t_s (at r_ref) of the fluctuation."""

    scale: float
    gamma: float
    t_s: float

    def height(self, field: "MeanField") -> Array:
        """Amplitude h (k,) of the fluctuation in a field, in units of gamma."""
        jitter, discrepancy = field.slope_m / field.r_m, field.model_discrepancy * np.log(field.r_m / field.r_ref_m)
        return np.asarray(np.sqrt(field.rarity + (jitter**2 + discrepancy**2) / self.gamma**2))

    def rate(self, field: "MeanField") -> Array:
        """Inverse correlation time (k,) [1/s] of the fluctuation in a field."""
        return np.asarray((field.r_ref_m / self.t_s + field.speed_m_s) / field.r_m)


@dataclass(frozen=True, slots=True, eq=False)
class MeanField:
    """Mean concentration field at the nose: concentration (k,) [ppm], rarity I (k,), distance r (k,) [m], speed v of the nose (k,) [m/s];
    n u_p [m], w, and r_ref [m]."""

    mean_ppm: Array
    rarity: Array
    r_m: Array
    speed_m_s: Array
    slope_m: float
    model_discrepancy: float
    r_ref_m: float


@dataclass(frozen=True, slots=True, eq=False)
class PathField:
    """Mean field along a path, with the time step dt (k,) [s] and lag tau (k,) [s] of its steps; for every reading its path index
    (m,), gain (m,) and nominal white-noise variance (m,) [ppm^2]."""

    field: MeanField
    dt_s: Array
    tau_s: Array
    at: NDArray[np.int64]
    gain: Array
    variance_ppm2: Array


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
        f = along.field
        self._along, self._noise = along, noise
        numbers = (f.slope_m, f.model_discrepancy, f.r_ref_m, noise.gamma, noise.t_s)
        self._steps = _lagged_ou_path(f.mean_ppm, f.rarity, f.r_m, f.speed_m_s, along.dt_s, along.tau_s, numbers)

    def of(self, rows: Array, variance_ppm2: Array) -> Whitened:
        """Whiten rows (m, p) [ppm] of readings with nominal variance (m,) [ppm^2]."""
        white, along, noise = self._noise.scale * variance_ppm2, self._along, self._noise
        return Whitened(*whitening_filter(np.ascontiguousarray(rows), along.at, self._steps, noise.gamma**2, along.gain, white))


@compiled
def lagged_ou_steps(dt: Array, tau: Array, t: Array, swing: Array, variance: float) -> Array:
    """Exact discretisation of  tau f' = swing m - f,  t m' = -m + noise (stationary variance of m given), per step (k, 6):
    phi = F00, F01, keep = F11, Q00 [ppm^2], Q01 [ppm], Q11.

    Q = P - F P F' with the stationary P, so that two half steps equal one whole step.
    """
    out = np.empty((len(dt), 6))
    for i in range(len(dt)):
        lagged_ou_step(np.exp(-dt[i] / tau[i]), np.exp(-dt[i] / t[i]), dt[i], tau[i], t[i], swing[i], variance, out[i])
    return out


@compiled
def lagged_ou_step(phi: float, keep: float, dt: float, tau: float, t: float, swing: float, variance: float, out: Array) -> None:
    """One step (6,) of `lagged_ou_steps`, given its decays exp(-dt / tau) and exp(-dt / t)."""
    difference = t - tau
    coupling = swing * (phi * dt / tau if abs(difference) < 1e-6 * tau else (keep - phi) * t / difference)
    p11 = variance
    p01 = swing * variance * t / (t + tau)
    p00 = swing * p01
    out[0], out[1], out[2] = phi, coupling, keep
    out[3] = p00 - (phi * phi * p00 + 2.0 * phi * coupling * p01 + coupling * coupling * p11)
    out[4] = p01 - keep * (phi * p01 + coupling * p11)
    out[5] = p11 * (1.0 - keep * keep)


@compiled
def _lagged_ou_path(
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
def fluctuation_ppm(mean: float, rarity: float, r: float, slope: float, w: float, r_ref: float, gamma: float) -> float:
    """Amplitude c h of the fluctuation [ppm], see `Fluctuation.height`."""
    jitter, discrepancy = slope / r, w * np.log(r / r_ref)
    return float(mean * np.sqrt(rarity + (jitter * jitter + discrepancy * discrepancy) / (gamma * gamma)))


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
