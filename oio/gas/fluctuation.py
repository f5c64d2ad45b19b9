"""How gas fluctuates about its mean, and readings made independent of each other by that.

The gas at the nose is c (1 + h m): m an Ornstein-Uhlenbeck process of variance gamma^2 and correlation time r / (r_ref / T + v), because
an eddy as wide as the plume there passes with the gas's own speed and the nose's v.  h^2 = I + (n u_p / gamma r)^2 + (w ln(r / r_ref) /
gamma)^2:  I is the rarity of the plume there (a plume that is there a fraction p of the time has variance mean^2 (1/p - 1)); u_p, how well
the kinematics know the nose from one moment to the next (free play), counts the more the nearer the source is; w is how far a real plume
strays from the law per e-fold of distance.

The sensor's lag smooths it, white noise is added. So the deviation of the readings from their mean is a linear process of two states, the
lagged deviation and m; a Kalman filter with frozen gains turns residuals into independent ones of variance one, and their Jacobians with
them (innovations form of the likelihood, Schweppe 1965).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oio.core.compiled import compiled
from oio.core.records import Array


@dataclass(frozen=True, slots=True)
class Fluctuation:
    """scale: variance of the white noise over the sensor's nominal one; gamma and t_s (at r_ref) of the gas."""

    scale: float
    gamma: float
    t_s: float

    def height(self, field: "MeanField") -> Array:
        """h (k,): how many times gamma the gas is uncertain in a field."""
        near, far = field.slope_m / field.r_m, field.model_discrepancy * np.log(field.r_m / field.r_ref_m)
        return np.asarray(np.sqrt(field.rarity + (near**2 + far**2) / self.gamma**2))

    def rate(self, field: "MeanField") -> Array:
        """1 / correlation time (k,) 1/s in a field."""
        return np.asarray((field.r_ref_m / self.t_s + field.speed_m_s) / field.r_m)


@dataclass(frozen=True, slots=True, eq=False)
class MeanField:
    """The mean field where the nose is: concentration (k,) ppm, rarity I (k,), distance r (k,) m, speed v of the nose (k,) m/s;
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
    """The field along a path, dt (k,) s and lag tau (k,) s of its steps; and of every reading its place on the path (m,), its gain
    (m,) and its nominal variance (m,) ppm^2."""

    field: MeanField
    dt_s: Array
    tau_s: Array
    at: NDArray[np.int64]
    gain: Array
    variance_ppm2: Array


@dataclass(frozen=True, slots=True, eq=False)
class Whitened:
    """Rows made independent (m, p), and the variances that the filter expected (m,) ppm^2."""

    rows: Array
    expected_ppm2: Array

    @property
    def minus_2_log_likelihood(self) -> float:
        """-2 ln L of the first column as residuals, up to a constant."""
        return float(self.rows[:, 0] @ self.rows[:, 0] + np.sum(np.log(self.expected_ppm2)))


def whiten(rows: Array, along: PathField, noise: Fluctuation) -> Whitened:
    """Rows (m, p) (residuals, Jacobians; all in ppm) through the whitening filter."""
    return Whitening(along, noise).of(rows, along.variance_ppm2)


class Whitening:
    """The filter along one path, made once for rows and variances of readings that come later."""

    def __init__(self, along: PathField, noise: Fluctuation) -> None:
        f = along.field
        self._along, self._noise = along, noise
        numbers = (f.slope_m, f.model_discrepancy, f.r_ref_m, noise.gamma, noise.t_s)
        self._steps = _lagged_ou_path(f.mean_ppm, f.rarity, f.r_m, f.speed_m_s, along.dt_s, along.tau_s, numbers)

    def of(self, rows: Array, variance_ppm2: Array) -> Whitened:
        """Rows (m, p) in ppm, of readings of nominal variance (m,) ppm^2."""
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
    """One step (6,) of `lagged_ou_steps`, its decays exp(-dt / tau) and exp(-dt / t) given."""
    slower = t - tau
    to = swing * (phi * dt / tau if abs(slower) < 1e-6 * tau else (keep - phi) * t / slower)
    p11 = variance
    p01 = swing * variance * t / (t + tau)
    p00 = swing * p01
    out[0], out[1], out[2] = phi, to, keep
    out[3] = p00 - (phi * phi * p00 + 2.0 * phi * to * p01 + to * to * p11)
    out[4] = p01 - keep * (phi * p01 + to * p11)
    out[5] = p11 * (1.0 - keep * keep)


@compiled
def _lagged_ou_path(
    mean: Array, rarity: Array, r: Array, speed: Array, dt: Array, tau: Array, numbers: tuple[float, float, float, float, float]
) -> Array:
    """`lagged_ou_steps` of a field, with the `height` and the `rate` of its fluctuations."""
    slope, w, r_ref, gamma, t_s = numbers
    out = np.empty((len(dt), 6))
    for i in range(len(dt)):
        high, t = fluctuation_ppm(mean[i], rarity[i], r[i], slope, w, r_ref, gamma), r[i] / (r_ref / t_s + speed[i])
        lagged_ou_step(np.exp(-dt[i] / tau[i]), np.exp(-dt[i] / t), dt[i], tau[i], t, high, gamma * gamma, out[i])
    return out


@compiled
def fluctuation_ppm(mean: float, rarity: float, r: float, slope: float, w: float, r_ref: float, gamma: float) -> float:
    """c h [ppm], see `Fluctuation.height`."""
    near, far = slope / r, w * np.log(r / r_ref)
    return float(mean * np.sqrt(rarity + (near * near + far * far) / (gamma * gamma)))


@compiled
def whitening_filter(rows: Array, at: NDArray[np.int64], steps: Array, variance: float, gain: Array, white: Array) -> tuple[Array, Array]:
    """Rows (m, p) made independent, and the variances expected (m,); `variance` is the fluctuation's, `white` (m,) the readings'."""
    m, p = rows.shape
    out, expected = np.empty((m, p)), np.empty(m)
    lagged, relative = np.zeros(p), np.zeros(p)  # state estimates, one per column
    # the first reading is where the lag was begun: it tells nothing more, and is as uncertain as a reading is
    p00, p01, p11 = white[0] / (gain[0] * gain[0]), 0.0, variance
    out[0], expected[0] = 0.0, 1.0
    step = at[0] + 1
    for i in range(1, m):
        through, across, kept = 1.0, 0.0, 1.0  # of all steps since the last reading: the columns take them at once
        while step <= at[i]:
            a, b, k = steps[step, 0], steps[step, 1], steps[step, 2]
            through, across, kept = a * through, a * across + b * kept, k * kept
            p00, p01, p11 = (
                a * a * p00 + 2.0 * a * b * p01 + b * b * p11 + steps[step, 3],
                k * (a * p01 + b * p11) + steps[step, 4],
                k * k * p11 + steps[step, 5],
            )
            step += 1
        p00, p11 = max(p00, 0.0), max(p11, 0.0)  # gas supposed 1e8 times the noise leaves no digits to subtract
        if p01 * p01 > p00 * p11:
            p01 = np.copysign(np.sqrt(p00 * p11), p01)
        g = gain[i]
        s = g * g * p00 + white[i]
        k0, k1, root = g * p00 / s, g * p01 / s, np.sqrt(s)
        expected[i] = s
        for j in range(p):
            f, r = through * lagged[j] + across * relative[j], kept * relative[j]
            innovation = rows[i, j] - g * f
            out[i, j] = innovation / root
            lagged[j] = f + k0 * innovation
            relative[j] = r + k1 * innovation
        p00, p01, p11 = p00 - k0 * g * p00, p01 - k0 * g * p01, p11 - k1 * g * p01
    return out, expected
