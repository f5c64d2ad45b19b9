"""Likelihood of left-censored readings (at the sensor's lower limit): Phi((limit - expected) / sigma), as in a Tobit model (Tobin 1958).

Such a reading means "not more than the limit"; its `ppm` is the limit. For a least-squares fit, -2 ln Phi is written as a squared
residual; for a filter, the truncated normal is moment-matched and written as a pseudo-measurement with its own value and variance.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from oio.core.records import Array

Flags = NDArray[np.bool_]
MAX_INFLATION = 1e12  # variance of an uninformative reading, over that of its prediction
CERTAIN_SIGMAS = 1e3  # prediction so many standard deviations above the limit: an ordinary reading, to the last digits
TINY = 1e-150  # floor of the hazard; its square does not underflow


def residual(miss: Array, sigma: Array, censored: Flags) -> Array:
    """Least-squares residuals (m,) [ppm] from reading minus prediction `miss` (m,); if censored w / w', w^2 = -2 ln Phi(miss / sigma).

    With the matching `variance` a Gauss-Newton step equals that of w, and the whitening filter treats an uninformative reading as a gap.
    """
    if not censored.any():
        return miss
    out = np.array(miss)
    ln_phi, hazard = _log_cdf_and_hazard(miss[censored] / sigma[censored])
    out[censored] = sigma[censored] * 2.0 * ln_phi / hazard
    return out


def variance(miss: Array, sigma: Array, censored: Flags) -> Array:
    """Variances (m,) [ppm^2] for `residual`: sigma^2, or sigma^2 / w'^2 if censored, which is sigma^2 far above the limit and grows
    up to MAX_INFLATION times that below it."""
    out = np.asarray(sigma**2)
    if not censored.any():
        return out
    ln_phi, hazard = _log_cdf_and_hazard(miss[censored] / sigma[censored])
    out[censored] *= np.clip(-2.0 * ln_phi / hazard**2, 1.0, MAX_INFLATION)
    return out


def _log_cdf_and_hazard(a: Array) -> tuple[Array, Array]:
    """ln Phi(a) and the hazard (inverse Mills ratio) phi(a) / Phi(a), each (k,)."""
    ln_phi = _log_cdf()(a)
    return ln_phi, np.maximum(np.exp(-0.5 * a * a - ln_phi) / np.sqrt(2.0 * np.pi), TINY)


def _log_cdf() -> Callable[[Any], Any]:
    """ln Phi. Imported where a reading is censored: 0.1 s, that most runs need not wait for."""
    from scipy.special import log_ndtr

    return log_ndtr  # type: ignore[no-any-return]


def pseudo_measurement(miss: float, s: float, r: float) -> tuple[float, float]:
    """Pseudo-measurement of a censored reading: innovation [ppm] and R [ppm^2], from s = H P H' + r and `miss`, limit minus prediction.

    A normal truncated above a = miss / sqrt(s) has mean -sqrt(s) g, variance s (1 - g (g + a)), g = phi(a) / Phi(a). An update whose
    innovation has variance s / (g (g + a)) and value -sqrt(s) / (g + a) gives these moments.
    """
    a = miss / float(np.sqrt(s))
    if a < -CERTAIN_SIGMAS:
        return miss, r
    g = float(np.exp(-0.5 * a * a - _log_cdf()(a)) / np.sqrt(2.0 * np.pi))
    reduction = max(g * (g + a), 1.0 / MAX_INFLATION)
    return -float(np.sqrt(s)) * g / reduction, s / reduction - (s - r)
