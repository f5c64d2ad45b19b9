"""What many trials say: shares with Wilson's interval, and whether covariances are honest."""

import numpy as np
from scipy.special import ndtri
from scipy.stats import chi2

from oio.inference.metrics import COVERAGE


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson 1927): it stays within 0 and 1, and no success among many is not certainty."""
    z2 = float(ndtri(0.5 + COVERAGE / 2)) ** 2
    middle = (successes + z2 / 2) / (trials + z2)
    half = np.sqrt(z2 * (successes * (trials - successes) / trials + z2 / 4)) / (trials + z2)
    return max(float(middle - half), 0.0), min(float(middle + half), 1.0)


def anees_band(trials: int, dimension: int = 3) -> tuple[float, float]:
    """Where the mean NEES over its dimension lies in 95 % of experiments if the filter is consistent (Bar-Shalom 2001, 5.4.2)."""
    n = trials * dimension
    low, high = chi2.ppf([0.5 - COVERAGE / 2, 0.5 + COVERAGE / 2], n) / n
    return float(low), float(high)


def rms_ratio(errors: list[float], bounds: list[float]) -> float:
    """Root mean square of every error over its own bound: one path that saw nothing does not hide the others."""
    return float(np.sqrt(np.mean(np.square(np.array(errors) / np.array(bounds)))))
