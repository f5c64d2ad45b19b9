"""Overlapping Allan deviation with chi-square confidence intervals (Riley, NIST SP 1065, 2008, 5.2.4 and 5.4).

Degrees of freedom are the simple formulas of Howe, Allan, Barnes (1981; SP 1065, table 5) for white, flicker and random-walk noise, which
is told at each tau by the lag 1 autocorrelation of the averages (Riley and Greenhall 2004; SP 1065, 5.5.6).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincinv

from oio.core.records import Array
from oio.identification.regular_series import RegularSeries

COVERAGE = 0.95
LONGEST_SHARE = 0.2  # of the record: beyond a fifth too few differences are independent (SP 1065, 5.2: 10 to 20 %)
AVERAGES_TO_TELL = 30  # fewer averages do not tell the noise; that of the tau before is taken
WHITE, FLICKER, RANDOM_WALK = 0, -1, -2  # exponents alpha of the power law, S(f) ~ f^alpha


@dataclass(frozen=True, slots=True, eq=False)
class AllanCurve:
    """Allan deviation (k,) at tau_s (k,) s with its 95 % interval low, high (k,), degrees of freedom edf (k,) and noise exponent (k,)."""

    tau_s: Array
    deviation: Array
    low: Array
    high: Array
    edf: Array
    alpha: NDArray[np.int64]
    period_s: float
    readings: int

    @property
    def longest_tau_s(self) -> float:
        """The longest tau that the record supports [s]."""
        return float(self.tau_s[-1])


def allan_curve(series: RegularSeries) -> AllanCurve:
    """Return the overlapping Allan deviation of a series at octaves of its period, up to a fifth of its span."""
    factors = octaves(len(series.value))
    theta = np.concatenate([[0.0], np.cumsum(series.value - series.value.mean())]) * series.period_s
    variance = np.array([_variance(theta, m, series.period_s) for m in factors.tolist()])
    alpha = _exponents(series.value, factors)
    edf = degrees_of_freedom(len(theta), factors, alpha)
    low, high = interval(variance, edf)
    tau_s = np.asarray(factors * series.period_s, dtype=np.float64)
    return AllanCurve(tau_s, np.sqrt(variance), np.sqrt(low), np.sqrt(high), edf, alpha, series.period_s, len(series.value))


def octaves(readings: int) -> NDArray[np.int64]:
    """Averaging factors 1, 2, 4 ... up to a fifth of the readings."""
    return 2 ** np.arange(int(np.log2(max(LONGEST_SHARE * readings, 1.0))) + 1)


def interval(variance: Array, edf: Array) -> tuple[Array, Array]:
    """95 % interval of a variance with so many degrees of freedom, by chi-square."""
    tail = 0.5 * (1.0 - COVERAGE)
    return edf * variance / chi2_quantile(1.0 - tail, edf), edf * variance / chi2_quantile(tail, edf)


def chi2_quantile(p: float, dof: Array | float) -> Array:
    """Quantile of chi-square with so many degrees of freedom, as `scipy.stats.chi2.ppf`, which takes half a second to import."""
    return np.asarray(2.0 * gammaincinv(0.5 * np.asarray(dof), p))


def _variance(theta: Array, m: int, period_s: float) -> float:  # <(theta_{i+2m} - 2 theta_{i+m} + theta_i)^2> / (2 m^2 period^2)
    second = theta[2 * m :] - 2.0 * theta[m:-m] + theta[: -2 * m]
    return float(np.mean(second**2) / (2.0 * (m * period_s) ** 2))


def degrees_of_freedom(n: int, m: NDArray[np.int64], alpha: NDArray[np.int64]) -> Array:
    """Equivalent degrees of freedom (k,) of the overlapping Allan variance of n integrated readings at averaging factors m (k,)."""
    white = (3.0 * (n - 1) / (2.0 * m) - 2.0 * (n - 2) / n) * 4.0 * m**2 / (4.0 * m**2 + 5.0)
    flicker = np.where(m == 1, 2.0 * (n - 2.0) ** 2 / (2.3 * n - 4.9), 5.0 * n**2 / (4.0 * m * (n + 3.0 * m)))
    walk = (n - 2.0) / m * ((n - 1.0) ** 2 - 3.0 * m * (n - 1) + 4.0 * m**2) / (n - 3.0) ** 2
    return np.asarray(np.maximum(np.choose(-alpha, [white, flicker, walk]), 1.0))


def _exponents(value: Array, factors: NDArray[np.int64]) -> NDArray[np.int64]:
    found = [WHITE]
    for m in factors.tolist():
        count = len(value) // m
        found.append(noise_exponent(value[: count * m].reshape(count, m).mean(axis=1)) if count >= AVERAGES_TO_TELL else found[-1])
    return np.array(found[1:], dtype=np.int64)


def noise_exponent(value: Array) -> int:
    """Exponent alpha of power-law noise from the lag 1 autocorrelation of readings (n,), limited to 0 (white) ... -2 (random walk)."""
    for differences in (0, 1):
        centred = value - value.mean()
        power = float(centred @ centred)
        r = float(centred[1:] @ centred[:-1]) / power if power > 0.0 else 0.0
        delta = r / (1.0 + r)
        if delta < 0.25:
            return int(np.clip(np.rint(-2.0 * (delta + differences)), RANDOM_WALK, WHITE))
        value = np.diff(value)
    return RANDOM_WALK
