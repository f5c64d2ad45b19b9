"""Percentile bootstrap intervals (Efron, Tibshirani 1993, ch. 13), the same on every machine and in every process."""

from collections.abc import Callable

import numpy as np

from oio.core.records import Array

RESAMPLES, LEVEL = 2000, 0.95


def interval(values: Array, statistic: Callable[..., Array]) -> tuple[float, float]:
    """Return the 95 % interval of `statistic(values, axis=-1)`, values (n,); NaN for fewer than two values."""
    if len(values) < 2:
        return float("nan"), float("nan")
    drawn = np.random.default_rng(0).integers(len(values), size=(RESAMPLES, len(values)))
    low, high = np.quantile(statistic(values[drawn], axis=-1), [0.5 - LEVEL / 2, 0.5 + LEVEL / 2])
    return float(low), float(high)
