"""Regular series: readings with gaps, bursts and jitter as the longest stretch at one sampling period, and an account of what was done."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oio.core.errors import NotObservable
from oio.core.records import Array

FEWEST = 16  # readings of which anything is told
FILLED = 2  # this many missing readings in a row are interpolated; a longer gap splits the record


@dataclass(frozen=True, slots=True, eq=False)
class RegularSeries:
    """Readings t_s (n,) s, value (n,) at one sampling period; `account` says what of the record was left out, averaged or filled."""

    t_s: Array
    value: Array
    period_s: float
    account: str

    @property
    def span_s(self) -> float:
        """Duration covered by the readings [s]."""
        return len(self.value) * self.period_s


def regular(t_s: Array, value: Array, fewest: int = FEWEST) -> RegularSeries:
    """Return the longest stretch of readings t_s (n,) s, increasing, value (n,) at their median period.

    Intervals are rounded to whole periods, so jitter below half a period is left as it is. Readings less than half a period apart are
    averaged, gaps of up to two readings are interpolated linearly, and longer ones split the record. Raises NotObservable for fewer
    than `fewest` readings in the stretch.
    """
    if len(t_s) < fewest:
        raise NotObservable(
            f"{len(t_s)} readings are too few to identify anything, {fewest} are needed; record longer: stage.warm_up.drift_record_s=60."
        )
    period_s = float(np.median(np.diff(t_s)))
    cell = np.concatenate([[0], np.cumsum(np.rint(np.diff(t_s) / period_s).astype(np.int64))])
    kept, first = np.unique(cell, return_index=True)
    mean, start_s = np.add.reduceat(value, first) / np.diff([*first, len(value)]), t_s[first]
    begin, end = _longest(kept)
    grid = np.arange(kept[begin], kept[end - 1] + 1)
    if len(grid) < fewest:
        raise NotObservable(
            f"the longest unbroken stretch has {len(grid)} readings at {period_s:.3g} s, {fewest} are needed; record longer, without gaps."
        )
    inside = slice(begin, end)
    averaged, filled = int(first[end] if end < len(first) else len(value)) - int(first[begin]) - (end - begin), len(grid) - (end - begin)
    return RegularSeries(
        np.interp(grid, kept[inside], start_s[inside]), np.interp(grid, kept[inside], mean[inside]), period_s,
        _account(t_s, grid, start_s[begin], averaged, filled, period_s),
    )  # fmt: skip


def _longest(cells: NDArray[np.int64]) -> tuple[int, int]:
    """Begin and end of the longest run of cells without a gap of more than `FILLED`."""
    edges = np.concatenate([[0], np.flatnonzero(np.diff(cells) > FILLED + 1) + 1, [len(cells)]])
    longest = int(np.argmax(np.diff(edges)))
    return int(edges[longest]), int(edges[longest + 1])


def _account(t_s: Array, grid: NDArray[np.int64], start_s: float, averaged: int, filled: int, period_s: float) -> str:
    used_s, whole_s = (len(grid) - 1) * period_s, float(t_s[-1] - t_s[0])
    notes = [f"{len(grid)} readings every {period_s:.3g} s"]
    if used_s < 0.98 * whole_s:
        notes.append(f"the longest stretch without a gap: {used_s / 60:.3g} of {whole_s / 60:.3g} min, from {start_s - t_s[0]:.0f} s")
    if averaged:
        notes.append(f"{averaged} averaged with a neighbour")
    if filled:
        notes.append(f"{filled} interpolated")
    return "; ".join(notes)
