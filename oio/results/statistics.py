"""Statistics over trials: Wilson's interval of a proportion, the consistency band of the ANEES, errors over their bounds."""

import numpy as np

from oio.inference.metrics import COVERAGE


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """Wilson's 95 % confidence interval of a proportion (1927): within 0 and 1, and no success among many is not certainty."""
    from scipy.stats import binomtest  # here: half a second of import, which a single run can do without

    interval = binomtest(successes, trials).proportion_ci(COVERAGE, method="wilson")
    return float(interval.low), float(interval.high)


def at_least(successes: int, trials: int, confidence: float = COVERAGE) -> float:
    """What a proportion is at least, with this confidence: one-sided lower limit of Clopper and Pearson (1934); 0 without a success."""
    if not successes:
        return 0.0
    from scipy.special import betaincinv  # here: a tenth of a second of import

    return float(betaincinv(successes, trials - successes + 1, 1.0 - confidence))


def anees_band(trials: int, dimension: int = 3) -> tuple[float, float]:
    """95 % band of the average NEES over its dimension for a consistent filter (Bar-Shalom, Li, Kirubarajan 2001, 5.4.2)."""
    from scipy.stats import chi2  # here: see `wilson`

    n = trials * dimension
    low, high = chi2.ppf([0.5 - COVERAGE / 2, 0.5 + COVERAGE / 2], n) / n
    return float(low), float(high)


def rms_ratio(errors: list[float], bounds: list[float]) -> float:
    """Root mean square of the ratios of errors to their own bounds, so that one path with a large bound does not hide the others."""
    return float(np.sqrt(np.mean(np.square(np.array(errors) / np.array(bounds)))))
