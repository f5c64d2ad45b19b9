"""A reading at its sensor's lower limit says only "not more than that": its likelihood is Phi((limit - expected) / sigma) (Tobin 1958).

`ppm` of such a reading is the limit. For a fit by least squares, -2 ln Phi is written as the square of a residual; a filter takes the
mean and variance of the normal that was cut off at the limit (moment matching), written as a reading with another value and variance.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from oio.core.records import Array

Flags = NDArray[np.bool_]
MAX_INFLATION = 1e12  # variance of a reading that tells nothing, in those of its prediction
CERTAIN_SIGMAS = 1e3  # standard deviations above the limit where it is a value like any other, to the last digits
TINY = 1e-150  # its square is still a number


def residual(miss: Array, sigma: Array, censored: Flags) -> Array:
    """Residuals (m,) ppm from reading minus expectation `miss` (m,): where censored, w / w' for a square w^2 = -2 ln Phi(miss / sigma).

    With `variance` beside it one step of Gauss-Newton is that of w, and a reading that tells nothing is a gap to the whitening.
    """
    if not censored.any():
        return miss
    out = np.array(miss)
    ln_phi, hazard = _cut(miss[censored] / sigma[censored])
    out[censored] = sigma[censored] * 2.0 * ln_phi / hazard
    return out


def variance(miss: Array, sigma: Array, censored: Flags) -> Array:
    """Variances (m,) ppm^2: sigma^2, where censored over w'^2: that of a value far above the limit, without end far below it."""
    out = np.asarray(sigma**2)
    if not censored.any():
        return out
    ln_phi, hazard = _cut(miss[censored] / sigma[censored])
    out[censored] *= np.clip(-2.0 * ln_phi / hazard**2, 1.0, MAX_INFLATION)
    return out


def _cut(a: Array) -> tuple[Array, Array]:
    """ln Phi(a) and phi(a) / Phi(a), each (k,)."""
    ln_phi = log_ndtr(a)
    return ln_phi, np.maximum(np.exp(-0.5 * a * a - ln_phi) / np.sqrt(2.0 * np.pi), TINY)


def pseudo_measurement(miss: float, s: float, r: float) -> tuple[float, float]:
    """Residual [ppm] and R [ppm^2] that stand for a censored reading: predicted variance s = H P H' + r, limit minus prediction `miss`.

    Of a normal cut off above a = miss / sqrt(s): mean -sqrt(s) g, variance s (1 - g (g + a)), g = phi(a) / Phi(a). An update whose
    innovation has variance s / (g (g + a)) and value -sqrt(s) / (g + a) ends there.
    """
    a = miss / float(np.sqrt(s))
    if a < -CERTAIN_SIGMAS:
        return miss, r
    g = float(np.exp(-0.5 * a * a - log_ndtr(a)) / np.sqrt(2.0 * np.pi))
    told = max(g * (g + a), 1.0 / MAX_INFLATION)
    return -float(np.sqrt(s)) * g / told, s / told - (s - r)
