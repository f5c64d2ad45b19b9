"""Least-squares fits of curves over time, with 95 % intervals that count correlated residuals as fewer."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import f as fisher
from scipy.stats import t as student

from oio.core.records import Array

COVERAGE = 0.95
CHANCE = 0.01  # with which noise may pass for the curve
Curve = Callable[[Array, Array], Array]  # parameters (p,) and t_s (n,) -> values (n,)


@dataclass(frozen=True, slots=True, eq=False)
class FittedCurve:
    """Parameters (p,), half-widths (p,) of their 95 % intervals, residuals (n,), and how many independent readings they are worth."""

    parameters: Array
    half_widths: Array
    residual: Array
    effective: float

    def stands_out(self, other: Array) -> bool:
        """Whether the curve is better than a simpler one with residuals `other` (n,) and two parameters less, by an F test at 1 %."""
        own, simple, p = float(np.sum(self.residual**2)), float(np.sum(other**2)), len(self.parameters)
        dof = max(self.effective - p, 2.0)
        return simple - own > own * 2.0 / dof * fisher.ppf(1.0 - CHANCE, 2, dof) and simple > 1e-20


def fit_curve(curve: Curve, t_s: Array, value: Array, starts: list[Array], low: Array, high: Array) -> FittedCurve:
    """Fit the parameters of a curve to readings value (n,) at t_s (n,) s, from the best of the starts (p,), within low and high (p,)."""
    fits = [
        least_squares(lambda p: curve(p, t_s) - value, np.clip(start, low, high), bounds=(low, high), x_scale="jac") for start in starts
    ]
    best = min(fits, key=lambda fit: float(fit.cost))
    p = len(best.x)
    effective = effective_size(best.fun)
    scale = np.maximum(np.linalg.norm(best.jac, axis=0), np.finfo(float).tiny)
    inverse = np.linalg.pinv((best.jac / scale).T @ (best.jac / scale)) / np.outer(scale, scale)
    variance = 2.0 * float(best.cost) / max(effective - p, 1.0)  # each parameter takes one independent reading from the residuals
    quantile = float(student.ppf(0.5 + 0.5 * COVERAGE, max(effective - p, 1.0)))
    return FittedCurve(best.x, quantile * np.sqrt(variance * np.diag(inverse)), best.fun, effective)


def effective_size(residual: Array) -> float:
    """Independent readings that residuals (n,) are worth: n / (1 + 2 sum rho_j), summed to the first negative pair (Geyer 1992)."""
    n, centred = len(residual), residual - residual.mean()
    spectrum = np.abs(np.fft.rfft(centred, 2 * n)) ** 2
    covariance = np.fft.irfft(spectrum)[:n]
    if covariance[0] <= 0.0:
        return float(n)
    rho = covariance / covariance[0]
    pairs = rho[: n - n % 2].reshape(-1, 2).sum(axis=1)
    negative = np.flatnonzero(pairs < 0.0)
    positive = pairs[: int(negative[0]) if len(negative) else len(pairs)]
    return float(np.clip(n / (2.0 * positive.sum() - 1.0), 2.0, n))
