"""Clock of a log: where it overflows, where it was reset, which rows are in order."""

from bisect import bisect_left
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from oio.core.records import Array

CONFIRM = 3  # rows behind a step back that go on from there: then the clock was reset, and no stamp was wild
FEW, MOST_BACK = 9, 0.2  # of steps, below which nothing is said of an order; share of steps back, above which there is none
PERIODS = 20  # a step over the overflow of at most so many usual ones is one: a reset just there is unlikely


def usual_step(t_s: Array) -> float:
    """Median of the steps forward [s]; NaN if there is none."""
    steps = np.diff(t_s)
    forward = steps[steps > 0.0]
    return float(np.median(forward)) if len(forward) else float("nan")


def newest_first(t_s: Array) -> bool:
    """Whether stamps (k,) never rise: an export that begins with its end."""
    steps = np.diff(t_s[np.isfinite(t_s)])
    return len(steps) >= CONFIRM and bool(np.all(steps <= 0.0) and np.any(steps < 0.0))


def disorder(t_s: Array) -> str | None:
    """Why most rows with stamps (k,) s would be lost, and what to do; None if they would not."""
    t_s = t_s[np.isfinite(t_s)]
    steps = np.diff(t_s)
    repeated, back = int(np.count_nonzero(steps == 0.0)), int(np.count_nonzero(steps < 0.0))
    if len(steps) < FEW:
        return None
    if 2 * repeated >= len(t_s):
        period_s = (np.ptp(t_s) + usual_step(t_s)) / len(t_s) if np.ptp(t_s) > 0.0 else np.nan
        typed = f"{period_s:.3g}" if np.isfinite(period_s) else "SECONDS"
        why = "it is coarser than the sampling, or several devices write into one table" if np.ptp(t_s) > 0.0 else "it is no clock"
        return (
            f"{repeated} of {len(t_s)} rows repeat the time stamp before them: {why}. Where rows come at even times type "
            f"recording.time_unit=row recording.period_s={typed}, else give another clock (recording.time=NAME) or one device's rows alone."
        )
    if back > MOST_BACK * len(steps):
        return (
            f"{back} of {len(t_s)} rows are earlier than the row before: they are in no order of time, or several devices write into one "
            f"table. Sort the file by its time, or keep one device's rows alone."
        )
    return None


def unwrapped(t_s: Array, wrap_s: float | None) -> tuple[Array, int]:
    """Return time stamps (k,) s that go on where the counter overflowed after `wrap_s`, and how often it did."""
    if wrap_s is None or len(t_s) < 2:
        return t_s, 0
    steps = np.diff(t_s)
    over = (steps < 0.0) & (steps + wrap_s > 0.0) & (steps + wrap_s <= PERIODS * usual_step(t_s))
    return t_s + wrap_s * np.concatenate(([0.0], np.cumsum(over))), int(np.count_nonzero(over))


def sessions(t_s: Array, max_gap_s: float | None = None) -> NDArray[np.intp]:
    """Return the number of the session of each row (k,), from 0: a new one begins where the clock was set back, or after a longer gap."""
    begins = np.zeros(len(t_s), dtype=np.intp)
    for i in np.flatnonzero(np.diff(t_s) < 0.0):
        wild = i > 0 and t_s[i - 1] < t_s[i + 1]  # the row before the step was an outlier: the clock goes on behind it
        after = t_s[i + 1 : i + 1 + CONFIRM]
        if not wild and len(after) == CONFIRM and np.all(after < t_s[i]) and np.all(np.diff(after) >= 0.0):
            begins[i + 1] = 1
    if max_gap_s is not None:
        begins[1:] |= np.diff(t_s) > max_gap_s
    return np.cumsum(begins)


def longest_increasing(stamps: Sequence[float]) -> list[int]:
    """Indices of the largest set of rows with strictly increasing time stamps: one outlier costs one row, not all that follow.

    Longest increasing subsequence by patience sorting, O(k log k): lowest[j] ends the best chain of j + 1 rows so far.
    """
    lowest: list[float] = []
    ends: list[int] = []
    before: list[int] = []
    for i, stamp in enumerate(stamps):
        j = bisect_left(lowest, stamp)
        before.append(ends[j - 1] if j else -1)
        lowest[j : j + 1], ends[j : j + 1] = [stamp], [i]
    chain, i = [], ends[-1] if ends else -1
    while i >= 0:
        chain.append(i)
        i = before[i]
    return chain[::-1]
