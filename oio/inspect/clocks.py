"""Clocks of a table: sampling, gaps, duplicates, resets, overflows; and two clocks compared."""

from dataclasses import dataclass

import numpy as np

from oio.core.records import Array
from oio.tabular.clock import longest_increasing, newest_first, sessions, unwrapped, usual_step
from oio.tabular.stamps import wrap_s

GAP = 3.0  # a step is a gap if it is longer than so many usual ones


@dataclass(frozen=True)
class Clock:
    """What a time column does. Durations are in `unit`: seconds if the unit of the column is known, else the column's own."""

    name: str
    notation: str | None  # None: not certain
    stamps: int
    missing: int  # rows without a time
    first: float
    last: float
    step: float  # median of the steps forward
    jitter: float  # 1.4826 times the median absolute deviation of the steps
    gaps: int
    longest: float
    longest_at: float  # since the first stamp
    duplicates: int
    out_of_order: int
    sizes: tuple[int, ...]  # rows of each session between resets
    overflows: int
    newest_first: bool

    @property
    def unit(self) -> str:
        """Unit of the durations."""
        return "s" if self.notation else "units"


def clock_of(name: str, notation: str | None, stamps: Array) -> Clock | None:
    """Survey a column of time stamps (k,), in seconds if their notation is known; None if fewer than two are numbers."""
    good = stamps[np.isfinite(stamps)]
    if len(good) < 2:
        return None
    turned = newest_first(good)
    good = good[::-1] if turned else good
    t, overflows = unwrapped(good, wrap_s(notation) if notation else None)
    steps, step, number = np.diff(t), usual_step(t), sessions(t)
    sizes = np.bincount(number)
    kept = sum(len(longest_increasing(t[number == i].tolist())) for i in range(len(sizes)))
    within = np.where(np.diff(number) == 0, steps, 0.0)
    duplicates = int(np.count_nonzero(steps == 0.0))
    forward = steps[steps > 0.0]
    longest = int(np.argmax(within))
    return Clock(
        name, notation, len(good), len(stamps) - len(good), float(t[0]), float(t[-1]), step,
        float(1.4826 * np.median(np.abs(forward - step))) if len(forward) else float("nan"), int(np.count_nonzero(within > GAP * step)),
        float(within[longest]), float(t[longest] - t[0]), duplicates, len(t) - kept - duplicates, tuple(sizes.tolist()), overflows, turned,
    )  # fmt: skip


@dataclass(frozen=True)
class Comparison:
    """One clock against another, by a straight line through the rows that both stamp."""

    names: tuple[str, str]
    rate_ppm: float  # how much faster the second is
    scatter_s: float  # largest deviation from the line


def compare(one: tuple[str, Array], other: tuple[str, Array]) -> Comparison | None:
    """Compare two columns of stamps (k,) [s]; None if no straight line holds for them."""
    both = np.isfinite(one[1]) & np.isfinite(other[1])
    a, b = one[1][both], other[1][both]
    if len(a) < 3 or np.ptp(a) == 0.0 or np.ptp(b) == 0.0:
        return None
    a, b = a - a[0], b - b[0]
    rate, offset = np.polyfit(a, b, 1)
    return Comparison((one[0], other[0]), float(1e6 * (rate - 1.0)), float(np.max(np.abs(b - rate * a - offset))))
