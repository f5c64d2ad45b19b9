"""Concentration fluctuation about the mean field: coloured noise, an Ornstein-Uhlenbeck process through the sensor's lag.

The concentration at the nose is c (1 + h m + g.q). m is an Ornstein-Uhlenbeck process of variance gamma^2 and correlation time
r / (r_ref / T + v), because an eddy as wide as the plume passes with the gas's own speed plus the speed v of the nose.
h^2 = I + (n u_p / gamma r)^2 + (w ln(r / r_ref) / gamma)^2:  I is the rarity (intermittency) of the plume (a plume that is present a
fraction p of the time has variance mean^2 (1/p - 1)); u_p is the nose jitter, the short-term uncertainty of the nose position (backlash),
which matters more near the source; w is the model discrepancy of a real plume from the range law per e-fold of distance.

q (3) is the sway of the whole plume (Gifford 1959, Adv. Geophys. 6:117): too strong on one side of the source, it is too weak on the other,
so a nose that moves about the source does not see independent errors. Its components are Ornstein-Uhlenbeck processes of one standard
deviation and correlation time, the same at every place; g = (d ln c / d k) / r, with the wind k of the range law, is in still air the unit
vector from the source. Where a model has no states for q, it is part of m: variances add, and rates are weighted with them.

At two places, d apart, the two m have the correlation exp(-d / r): what a move of the nose over d leaves of the correlation in time.

The sensor lag smooths this: the deviation of the readings from their mean is a linear process with two states, the lagged deviation and m,
whose exact discretisation is here. `oio.gas.whitening` makes readings independent with it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oio.core.compiled import compiled
from oio.core.records import Array


@dataclass(frozen=True, slots=True)
class Fluctuation:
    """Noise parameters: `scale`, white-noise variance over the sensor's nominal one; gamma and t_s (at r_ref) of the fluctuation; standard
    deviation and correlation time of each component of the sway."""

    scale: float
    gamma: float
    t_s: float
    sway: float = 0.0
    sway_s: float = 6.0

    def height(self, field: "MeanField") -> Array:
        """Amplitude (k,) of the fluctuation in a field, sway included, in units of gamma."""
        return np.asarray(np.sqrt(sum(self._squares(field))))

    def rate(self, field: "MeanField") -> Array:
        """Inverse correlation time (k,) [1/s] of the fluctuation in a field, sway included."""
        eddies, sway = self._squares(field)
        rate = (field.r_ref_m / self.t_s + field.speed_m_s) / field.r_m
        return np.asarray((eddies * rate + sway / self.sway_s) / (eddies + sway))

    def _squares(self, field: "MeanField") -> tuple[Array, Array]:
        jitter, discrepancy = field.slope_m / field.r_m, field.model_discrepancy * np.log(field.r_m / field.r_ref_m)
        sway = np.sum(np.square(field.by_wind_m), axis=1) * (self.sway / (self.gamma * field.r_m)) ** 2
        return np.asarray(field.rarity + (jitter**2 + discrepancy**2) / self.gamma**2), np.asarray(sway)


@dataclass(frozen=True, slots=True, eq=False)
class MeanField:
    """Mean concentration field at the nose: concentration (k,) [ppm], rarity I (k,), distance r (k,) [m], speed v of the nose (k,) [m/s];
    n u_p [m], w, and r_ref [m]; d ln c / d k (k, 3) [m]."""

    mean_ppm: Array
    rarity: Array
    r_m: Array
    speed_m_s: Array
    slope_m: float
    model_discrepancy: float
    r_ref_m: float
    by_wind_m: Array


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
    second: "SecondPlace | None" = None  # of a sensor whose elements are at two places

    @property
    def r_of_readings(self) -> Array:
        """Distance (m,) [m] from the source at every reading."""
        if self.second is None:
            return np.asarray(self.field.r_m[self.at])
        return np.where(self.second.is_second, self.second.field.r_m[self.at], self.field.r_m[self.at])


@dataclass(frozen=True, slots=True, eq=False)
class SecondPlace:
    """Second place of sensing along the same path: its mean field and lag tau (k,) [s], which readings (m,) are from there, and its
    distance [m] from the first."""

    field: MeanField
    tau_s: Array
    is_second: NDArray[np.bool_]
    spacing_m: float


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
def lagged_ou_cross(step: Array, other: Array, tau: Array, t: Array, swing: Array, variance: float, rho: float, out: Array) -> None:
    """Cross-covariance (4,) that one step adds between (f, m) at one place and at another: f f, f m, m f and m m.

    `step`, `other` (6,): from `lagged_ou_step`; tau, t and swing (2,) are those of both places; rho is the correlation of what drives
    the two m. Q = P - F P F' with the stationary P of the continuous process, as for one place.
    """
    rate, other_rate = 1.0 / t[0], 1.0 / t[1]
    mm = 2.0 * rho * variance * np.sqrt(rate * other_rate) / (rate + other_rate)
    fm, mf = swing[0] * mm / (1.0 + tau[0] * other_rate), swing[1] * mm / (1.0 + tau[1] * rate)
    ff = (swing[0] * mf * tau[1] + swing[1] * fm * tau[0]) / (tau[0] + tau[1])
    out[0] = ff - (step[0] * (other[0] * ff + other[1] * fm) + step[1] * (other[0] * mf + other[1] * mm))
    out[1] = fm - other[2] * (step[0] * fm + step[1] * mm)
    out[2] = mf - step[2] * (other[0] * mf + other[1] * mm)
    out[3] = mm * (1.0 - step[2] * other[2])


@compiled
def fluctuation_ppm(mean: float, rarity: float, r: float, slope: float, w: float, r_ref: float, gamma: float) -> float:
    """Amplitude c h of the fluctuation [ppm], see `Fluctuation.height`."""
    jitter, discrepancy = slope / r, w * np.log(r / r_ref)
    return float(mean * np.sqrt(rarity + (jitter * jitter + discrepancy * discrepancy) / (gamma * gamma)))


@compiled
def with_sway(amplitude: float, t: float, of_sway: float, sway_s: float) -> tuple[float, float]:
    """Amplitude and correlation time [s] of a fluctuation that includes a sway of amplitude `of_sway`; amplitudes are in units of gamma."""
    eddies, sway = amplitude * amplitude, of_sway * of_sway
    if sway == 0.0:
        return amplitude, t
    return float(np.sqrt(eddies + sway)), (eddies + sway) / (eddies / t + sway / sway_s)
