"""Slope of the Allan deviation at the longest tau of a record: which noise averaging would meet next.

d ln sigma / d ln tau is -0.5 for white noise, 0 for bias instability, +0.5 for a random walk, and +1 for a straight drift (IEEE Std 952,
annex C). It is that of the fitted N, B, K, R: the difference of the last two octaves has a handful of degrees of freedom, and scatters by
half.
"""

from dataclasses import dataclass

import numpy as np

from oio.core.records import Array

FLOOR = 2.0 * np.log(2.0) / np.pi  # of the variance, over that of the bias instability


@dataclass(frozen=True, slots=True)
class EndSlope:
    """Slope of the fitted Allan deviation at tau_s, the longest that a record of span_s supports, and its drift R [unit/s]."""

    slope: float
    tau_s: float
    span_s: float
    drift_per_s: float


def end_slope(t_s: Array, value: Array) -> EndSlope:
    """Return it for readings value (n,) at t_s (n,) s. Raises NotObservable for a record too short, or of readings that never change."""
    from oio.identification.allan import allan_curve  # here: they import scipy.optimize, which a run without a record can do without
    from oio.identification.allan_fit import fit_allan
    from oio.identification.regular_series import regular

    series = regular(t_s, value)
    fit = fit_allan(allan_curve(series))
    slope = _slope(fit.squares, fit.curve.longest_tau_s, fit.curve.period_s)
    return EndSlope(slope, fit.curve.longest_tau_s, series.span_s, float(np.sqrt(fit.squares[3])))


def _slope(squares: Array, tau_s: float, period_s: float) -> float:  # (tau / 2 sigma^2) d sigma^2 / d tau, term by term
    n2, b2, k2, r2 = squares
    white, walk, of_period, ramp = n2 / tau_s, k2 * tau_s / 3.0, k2 * period_s**2 / (6.0 * tau_s), 0.5 * r2 * tau_s**2
    whole = white + FLOOR * b2 + walk + of_period + ramp
    return float((walk + 2.0 * ramp - white - of_period) / (2.0 * whole))
