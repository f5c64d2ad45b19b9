"""Delay between gas and joints: cross-correlation of the logarithm of the reading with minus the logarithm of the range, interpolated.

A lag of the sensor delays the reading, too: the peak is the dead time plus roughly the time constant where the nose moves slowly.
"""

from dataclasses import dataclass

import numpy as np

from oio.core.errors import NotObservable
from oio.core.records import Array

BLOCKS = 8  # of the record; whole blocks are drawn, so that correlated readings stay together
DRAWS = 400
COVERAGE = 0.95
FEWEST = 6  # blocks of at least so many readings


@dataclass(frozen=True, slots=True)
class Delay:
    """Delay of the readings behind the joints [s], its 95 % interval, and the correlation at the peak."""

    delay_s: float
    low_s: float
    high_s: float
    correlation: float


def delay(period_s: float, range_m: Array, reading_ppm: Array, longest_s: float, rng: np.random.Generator) -> Delay:
    """Delay of readings (n,) ppm above clean air behind ranges (n,) m to the source, sampled together every period_s.

    Delays from -longest_s to longest_s are tried, the peak is interpolated by a parabola, and the interval is that of a bootstrap over
    blocks. Raises NotObservable if the record is too short, if range or reading does not change, if the peak is at the end of the
    delays tried, or if the interval is more than half of them.
    """
    lags = max(round(longest_s / period_s), 1)
    length = (len(range_m) - 2 * lags) // BLOCKS
    if length < FEWEST:
        needed_s = (FEWEST * BLOCKS + 2 * lags) * period_s
        raise NotObservable(
            f"{len(range_m) * period_s:.3g} s are too short for a delay up to {longest_s:g} s; {needed_s:.3g} s are needed."
        )
    near, gas = _standardised(-np.log(range_m)), _standardised(np.log(np.maximum(reading_ppm, _smallest(reading_ppm))))
    products = _block_products(near, gas, lags, length)
    best = _peak(products.sum(axis=0), lags)
    drawn = [_peak(products[rng.integers(BLOCKS, size=BLOCKS)].sum(axis=0), lags) for _ in range(DRAWS)]
    if abs(best) >= lags:
        raise NotObservable(f"the correlation has no peak within {longest_s:g} s; move the nose to and fro, or allow a longer delay.")
    low, high = np.quantile(drawn, [0.5 - 0.5 * COVERAGE, 0.5 + 0.5 * COVERAGE])
    if high - low > lags:
        raise NotObservable(f"the delay is not told to better than {(high - low) * period_s:.2g} s; move the nose to and fro for longer.")
    correlation = float(products.sum(axis=0).max() / (BLOCKS * length))
    return Delay(best * period_s, float(low) * period_s, float(high) * period_s, correlation)


def _smallest(ppm: Array) -> float:
    """Floor of readings before their logarithm: the lowest positive tenth; below it they are noise."""
    positive = ppm[ppm > 0.0]
    if not len(positive):
        raise NotObservable("no reading is above clean air, so there is no delay to find; sniff nearer to the source.")
    return float(np.quantile(positive, 0.1))


def _standardised(value: Array) -> Array:
    if np.ptp(value) == 0.0:
        raise NotObservable("range or readings do not change, so there is no delay to find; move the nose to and fro before the source.")
    return np.asarray((value - value.mean()) / value.std())


def _block_products(near: Array, gas: Array, lags: int, length: int) -> Array:
    """Sums of products (BLOCKS, 2 lags + 1) of each block of `near` with the readings at each lag after it."""
    start = lags + length * np.arange(BLOCKS)
    inside = start[:, None] + np.arange(length)
    return np.stack([np.sum(near[inside] * gas[inside + lag], axis=1) for lag in range(-lags, lags + 1)], axis=1)


def _peak(products: Array, lags: int) -> float:
    """Lag of the largest product, by the parabola through it and its neighbours."""
    top = int(np.argmax(products))
    if top in (0, 2 * lags):
        return float(top - lags)
    before, at, after = products[top - 1 : top + 2]
    return float(top - lags + 0.5 * (before - after) / (before - 2.0 * at + after))
