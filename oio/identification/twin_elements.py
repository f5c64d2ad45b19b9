"""Twin elements: gain and offset of one relative to the other with errors in both (Deming 1943), and what their average is worth."""

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from oio.core.errors import NotObservable
from oio.core.records import Array

COVERAGE = 0.95
BLOCKS = 20  # of the jackknife: whole blocks are left out, so that correlated readings go together
WIDEST = 0.5  # half-width of the gain's interval over the gain, beyond which it says nothing
AVERAGE_IS_WORSE = 3.0  # ratio of variances above which the average of two is worse than the better one alone


@dataclass(frozen=True, slots=True)
class Relation:
    """reading = gain * first + offset, each with the half-width of its 95 % interval; `offset` is at the mean of the first."""

    gain: float
    gain_half_width: float
    offset: float
    offset_half_width: float
    at: float


@dataclass(frozen=True, slots=True)
class Averaging:
    """Root mean square error against a reference of two elements and of their average, as they are and with their offsets removed."""

    first: float
    second: float
    average: float
    first_no_offset: float
    second_no_offset: float
    average_no_offset: float

    @property
    def helps(self) -> bool:
        """Whether the average of the readings as they are beats both elements."""
        return self.average < min(self.first, self.second)

    @property
    def helps_no_offset(self) -> bool:
        """Whether it does once offsets are removed."""
        return self.average_no_offset < min(self.first_no_offset, self.second_no_offset)


def relation(first: Array, other: Array, noise_ratio: float = 1.0) -> Relation:
    """Relation of an element's readings (n,) to the first element's (n,); noise_ratio is its noise variance over the first's.

    Intervals are those of a jackknife over blocks. Raises NotObservable where the gas hardly varies, or for fewer than 40 readings.
    """
    if len(first) < 2 * BLOCKS:
        raise NotObservable(f"{len(first)} pairs of readings are too few for a gain, {2 * BLOCKS} are needed; record longer.")
    blocks = np.array_split(np.arange(len(first)), BLOCKS)
    at, whole = float(first.mean()), np.array(_deming(first, other, noise_ratio, first.mean()))
    kept = [np.delete(np.arange(len(first)), block) for block in blocks]
    left_out = np.array([_deming(first[rows], other[rows], noise_ratio, at) for rows in kept])
    u = np.sqrt((BLOCKS - 1) / BLOCKS * np.sum((left_out - left_out.mean(axis=0)) ** 2, axis=0))
    gain_half, offset_half = (float(x) for x in student.ppf(0.5 + 0.5 * COVERAGE, BLOCKS - 1) * u)
    if gain_half > WIDEST * abs(whole[0]):
        raise NotObservable("the gas hardly varied, so gains cannot be told from noise; record while it rises or falls.")
    return Relation(float(whole[0]), gain_half, float(whole[1]), offset_half, at)


def _deming(x: Array, y: Array, ratio: float, at: float) -> tuple[float, float]:
    """Gain, and the second element's excess over the first where that reads `at`."""
    (sxx, sxy), (_, syy) = np.cov(x, y)
    if sxy == 0.0:
        return 0.0, float(y.mean() - at)
    gain = (syy - ratio * sxx + np.sqrt((syy - ratio * sxx) ** 2 + 4.0 * ratio * sxy**2)) / (2.0 * sxy)
    return float(gain), float(y.mean() + gain * (at - x.mean()) - at)


def averaging(first: Array, second: Array, reference: Array) -> Averaging:
    """Compare two elements (n,) and their average with a reference (n,), as they are and with each offset removed."""
    pair = [first, second, 0.5 * (first + second)]
    centred = [x - np.mean(x - reference) for x in (first, second)]
    no_offset = [*centred, 0.5 * (centred[0] + centred[1])]
    return Averaging(*(float(np.sqrt(np.mean((x - reference) ** 2))) for x in (*pair, *no_offset)))


def average_is_worse(first_variance: float, second_variance: float) -> bool:
    """Whether the plain average of two independent elements is noisier than the better alone: one variance above three times the other."""
    low, high = sorted((first_variance, second_variance))
    return high > AVERAGE_IS_WORSE * low
