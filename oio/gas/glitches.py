"""Readings that a sensor with a lag cannot have given: a spike that is gone at once, a drop from which it is back at once.

A sensor of first order forgets no faster than exp(-t / tau): after a reading c, whatever the gas does, the next is at least
b + (c - b) exp(-dt / tau), where b is what it reads in clean air. What is below that proves one of the two wrong.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from oio.core.records import Array, GasReading, seconds

FASTER = 3.0  # than the data sheet says a sensor may be: its lag is known to a factor
SIGMAS = 8.0  # of the noise of a difference, beyond which it is none
LONGEST = 10  # readings of one glitch; what lasts longer is a step of the baseline, or a sensor that is faster
MOST = 0.05  # share of readings; where more fall faster than can be, the sensor is faster than its data sheet
PASSES = 20  # a glitch beside another may be seen when that is gone


def glitches(readings: Sequence[GasReading], fall_s: float) -> NDArray[np.bool_]:
    """Which readings (m,), of any elements in order of time, a sensor whose lag is `fall_s` [s] in falling gas cannot have given."""
    found = np.zeros(len(readings), dtype=np.bool_)
    elements = np.array([reading.element for reading in readings])
    for element in np.unique(elements):
        (own,) = np.nonzero(elements == element)
        t_s, ppm, sigma = np.array([(seconds(r.t_ns), r.ppm, r.sigma_ppm) for r in readings if r.element == element]).T
        found[own] = _glitches(t_s, ppm, fall_s / FASTER, max(float(np.median(sigma)), _noise(ppm)))
    return found


def _noise(ppm: Array) -> float:
    """Standard deviation of white noise, from differences of neighbours; most of them are not a glitch."""
    return float(1.4826 * np.median(np.abs(np.diff(ppm)))) / np.sqrt(2.0) if len(ppm) > 1 else 0.0


def _glitches(t_s: Array, ppm: Array, tau_s: float, noise_ppm: float) -> NDArray[np.bool_]:
    """Those of one element (m,)."""
    margin = SIGMAS * np.sqrt(2.0) * noise_ppm
    bad = np.zeros(len(ppm), dtype=np.bool_)
    for _ in range(PASSES):
        kept = np.flatnonzero(~bad)
        t, c = t_s[kept], ppm[kept]
        least = c.min() + (c[:-1] - c.min()) * np.exp(-np.diff(t) / tau_s) - margin
        before = int(bad.sum())
        for at in np.flatnonzero(c[1:] < least).tolist():
            if not bad[kept[at : at + 2]].any():
                bad[kept[_wrong(c, at)]] = True
        if int(bad.sum()) == before:
            break
    return bad if bad.mean() <= MOST else np.zeros_like(bad)


def _wrong(c: Array, at: int) -> slice:
    """Which of the readings c (m,) are wrong, where they fall from `at` to the next faster than can be: those before, up to a rise of half
    of that fall, or those after, down to one, whichever are fewer; none, if neither is near."""
    rise = np.diff(c) > 0.5 * (c[at] - c[at + 1])
    first = max(at + 1 - LONGEST, 0)
    begins = [*([0] if first == 0 else []), *(np.flatnonzero(rise[first:at]) + first + 1).tolist()]
    ends = [*(np.flatnonzero(rise[at + 1 : at + 1 + LONGEST]) + at + 1).tolist(), *([len(c) - 1] if at + 1 + LONGEST >= len(c) else [])]
    up = slice(begins[-1], at + 1) if begins else None
    down = slice(at + 1, ends[0] + 1) if ends else None
    near = [part for part in (up, down) if part is not None and part.stop - part.start <= LONGEST]
    return min(near, key=lambda part: part.stop - part.start, default=slice(0, 0))
