"""Has the sensor settled? KPSS test of stationarity (Kwiatkowski, Phillips, Schmidt, Shin 1992), and the trend with a robust interval."""

from dataclasses import dataclass

import numpy as np

from oio.core.records import Array
from oio.identification.hac import bandwidth, long_run_covariance, regression

P_VALUES = (0.10, 0.05, 0.025, 0.01)
CRITICAL = {"level": (0.347, 0.463, 0.574, 0.739), "trend": (0.119, 0.146, 0.176, 0.216)}  # their table 1


@dataclass(frozen=True, slots=True)
class Kpss:
    """KPSS statistic, the lags of its long-run variance, and its p-value, limited to the 0.01 to 0.10 of the published table."""

    statistic: float
    lags: int
    p_value: float

    @property
    def stationary(self) -> bool:
        """Whether stationarity is not rejected at 5 %."""
        return self.p_value > 0.05


@dataclass(frozen=True, slots=True)
class Trend:
    """Slope of a line through readings [ppm/s] and the half-width of its 95 % interval, which counts correlated readings as they count."""

    slope: float
    half_width: float

    @property
    def vanishes(self) -> bool:
        """Whether zero is in the interval."""
        return abs(self.slope) <= self.half_width


def kpss(value: Array, about: str = "level") -> Kpss:
    """KPSS test of evenly sampled readings (n,): are they stationary about a `level`, or about a `trend`?

    eta = sum_t S_t^2 / (n^2 s^2), where S_t are the partial sums of the residuals and s^2 is their long-run variance.
    """
    n = len(value)
    design = np.column_stack([np.ones(n), np.linspace(-1.0, 1.0, n)])[:, : 1 if about == "level" else 2]
    residual = value - design @ np.linalg.lstsq(design, value, rcond=None)[0]
    lags = bandwidth(residual)
    long_run = float(long_run_covariance(residual[:, None], lags)[0, 0])
    if long_run <= np.finfo(float).eps * max(float(np.mean(value**2)), np.finfo(float).tiny):
        return Kpss(0.0, lags, P_VALUES[0])  # readings that never change are stationary
    statistic = float(np.sum(np.cumsum(residual) ** 2) / (n**2 * long_run))
    return Kpss(statistic, lags, float(np.interp(statistic, CRITICAL[about], P_VALUES)))


def trend(t_s: Array, value: Array) -> Trend:
    """Slope of a line through readings value (n,) at t_s (n,) s, by least squares with Newey and West's interval."""
    slopes, half_widths = regression(np.column_stack([np.ones(len(t_s)), t_s - t_s.mean()]), value)
    return Trend(float(slopes[1]), float(half_widths[1]))
