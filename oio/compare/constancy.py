"""Test of whether k values with their standard uncertainties are one constant (Welch's test), and their trend."""

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, chdtri, fdtrc

from oio.core.records import Array

_EXACT = 1e-9  # a value without uncertainty counts as one with this share of the largest


@dataclass(frozen=True, slots=True)
class Constancy:
    """chi2: weighted squares about the weighted mean, with dof = k - 1; p: probability of as much by chance; None where it cannot be told.

    normal_chi2: the chi-square that is as improbable where every u is known exactly, so that such may be added.
    trend_sd: slope over its standard deviation, values in order and equally apart; for two values their difference over its own.
    """

    chi2: float
    dof: int
    p: float | None
    normal_chi2: float
    trend_sd: float


def constancy(values: Array, u: Array, u_dof: Array) -> Constancy:
    """Test values (k,) with standard uncertainties u (k,) >= 0, not all zero, and the degrees of freedom u_dof (k,) of these.

    B. L. Welch, "On the comparison of several mean values", Biometrika 38 (1951) 330. For two values this is Student's t with the
    effective degrees of freedom of Welch and Satterthwaite (GUM G.4.1).
    """
    k, x = len(values), values - values[0]  # so that equal values give zero, not rounding
    w = 1.0 / np.maximum(u, _EXACT * np.max(u)) ** 2
    share = w / np.sum(w)
    chi2 = float(np.sum(w * (x - share @ x) ** 2))
    if np.any(u_dof <= 0.0):
        return Constancy(chi2, k - 1, None, 0.0, _trend_sd(x, w))
    spread = float(np.sum((1.0 - share) ** 2 / u_dof))
    p = _p(chi2, k, spread)
    return Constancy(chi2, k - 1, p, float(chdtri(k - 1, p)) if 0.0 < p < 1.0 and spread > 0.0 else chi2, _trend_sd(x, w))


def _p(chi2: float, k: int, spread: float) -> float:
    """Welch's F; `spread` is the sum of (1 - w / W)^2 / nu, zero where every u is known exactly."""
    if spread == 0.0:
        return float(chdtrc(k - 1, chi2))
    f = chi2 / (k - 1) / (1.0 + 2.0 * (k - 2) / (k**2 - 1) * spread)
    return float(fdtrc(k - 1, (k**2 - 1) / (3.0 * spread), f))


def _trend_sd(values: Array, w: Array) -> float:
    """Slope of the weighted straight line over its standard deviation."""
    at = np.arange(len(values)) - w @ np.arange(len(values)) / np.sum(w)
    return float(w @ (at * values) / np.sqrt(w @ at**2))


def joint_chi2(values: Array, covariances: Array) -> float:
    """Return the chi-square of vectors (k, n) with covariances (k, n, n) against one constant vector; it has (k - 1) n degrees of freedom.

    For two vectors it is the square of the Mahalanobis distance, d' (P_a + P_b)^-1 d.
    """
    scale = np.sqrt(np.max(np.diagonal(covariances, axis1=1, axis2=2), axis=0))  # units differ by orders of magnitude
    x = (values - values[0]) / scale
    weights = np.linalg.inv(covariances / np.outer(scale, scale))
    mean = np.linalg.solve(np.sum(weights, axis=0), np.einsum("kij,kj->i", weights, x))
    return float(np.einsum("ki,kij,kj->", x - mean, weights, x - mean))
