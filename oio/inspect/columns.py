"""Columns of a table: range, missing values, codes for no value, stuck and saturated stretches, counts of a converter."""

from dataclasses import dataclass

import numpy as np

from oio.core.records import Array
from oio.tabular.guess import codes
from oio.tabular.names import role_of, unit_of

STUCK = 20  # rows in a row with one value, and ten times as long as usual: more than a slow device that is polled often
AT_END = 5  # rows in a row at the highest value: the end of a scale
BITS = (8, 10, 12, 14, 16, 24)  # of converters


@dataclass(frozen=True)
class Column:
    """What a column holds; texts are remarks for people."""

    name: str
    role: str | None
    unit: str | None
    numbers: int
    others: int  # rows without a number
    low: float
    middle: float
    high: float
    remarks: tuple[str, ...]


def column_of(name: str, values: Array) -> Column:
    """Survey a column (k,), in which NaN is no number."""
    good = values[np.isfinite(values)]
    if not len(good):
        return Column(name, role_of(name), unit_of(name), 0, len(values), np.nan, np.nan, np.nan, ("no numbers",))
    low, middle, high = (float(value) for value in np.quantile(good, (0.0, 0.5, 1.0)))
    return Column(
        name, role_of(name), unit_of(name), len(good), len(values) - len(good), low, middle, high, _remarks(name, values, good, high)
    )


def _remarks(name: str, values: Array, good: Array, high: float) -> tuple[str, ...]:
    said = [f"{code:g} in {count} rows may mean no value" for code, count in codes(values).items()]
    starts, lengths = runs(values)
    longest = int(np.argmax(lengths))
    if np.ptp(good) == 0.0:
        said.append("always the same value")
    else:
        ends = values[starts] == high
        if lengths[ends].max() >= AT_END:
            said.append(
                f"at its highest value, {high:g}, for {lengths[ends].max()} rows in a row ({lengths[ends].sum()} in all): saturated?"
            )
        if lengths[longest] >= max(STUCK, 10 * np.median(lengths)) and not ends[longest]:
            said.append(f"stuck at {values[starts[longest]]:g} for {lengths[longest]} rows from row {starts[longest] + 1}")
    counts = _converter(good)
    if counts and role_of(name) not in ("temperature", "humidity", "time") and unit_of(name) in (None, "counts"):
        said.append(f"whole numbers: counts of a {counts}-bit converter?")
    return tuple(said)


def runs(values: Array) -> tuple[Array, Array]:
    """Return where runs of one value begin in a column (k,), and how long they are; NaN ends a run."""
    starts = np.concatenate(([0], np.flatnonzero(values[1:] != values[:-1]) + 1))
    return starts, np.diff(np.concatenate((starts, [len(values)])))


def _converter(good: Array) -> int:
    """Bits of the smallest converter that gives such whole numbers; 0 if none does."""
    if np.any(good != np.floor(good)) or good.min() < 0 or len(np.unique(good[:1000])) < 8:
        return 0
    return next((bits for bits in BITS if good.max() < 2**bits), 0)
