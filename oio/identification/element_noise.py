"""Noise of each element of an array in clean air, its bout threshold, and which elements are noisier than the others."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oio.core.errors import NotObservable
from oio.core.records import Array

NOISY = 3.5  # modified z-score of sigma above which an element is an outlier (Iglewicz, Hoaglin 1993)
LEAST_SPREAD = 0.2  # of sigma over its median: elements of one type differ by a fifth even where a handful happens to agree
FEWEST = 16  # readings


@dataclass(frozen=True, slots=True)
class ElementNoise:
    """White noise of one element, its spread about the mean, the bout threshold above the mean that follows, and whether it is noisy."""

    sigma: float
    spread: float
    threshold: float
    noisy: bool


def element_noise(value: Array) -> tuple[ElementNoise, ...]:
    """Noise of m elements from clean-air readings (n, m): sigma from differences of neighbours, which slow drift hardly changes.

    The threshold is three times the spread, which drift does raise, as it must. Noisy elements stand out of the others' sigma by the median
    and the median absolute deviation; fewer than three elements have no others. Raises NotObservable for fewer than 16 readings.
    """
    if len(value) < FEWEST:
        raise NotObservable(f"{len(value)} readings of clean air are too few for the noise, {FEWEST} are needed; record longer.")
    sigma, spread = np.std(np.diff(value, axis=0), axis=0) / np.sqrt(2.0), np.std(value, axis=0, ddof=1)
    rows = zip(sigma.tolist(), spread.tolist(), _outliers(sigma).tolist(), strict=True)
    return tuple(ElementNoise(s, d, 3.0 * d, bool(flag)) for s, d, flag in rows)


def _outliers(size: Array) -> NDArray[np.bool_]:
    if len(size) < 3:
        return np.zeros(len(size), dtype=np.bool_)
    middle = float(np.median(size))
    scale = max(float(np.median(np.abs(size - middle))) / 0.6745, LEAST_SPREAD * middle)
    return np.asarray(size - middle > NOISY * scale)
