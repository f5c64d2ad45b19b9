"""Usable rows of a table, and a count of the dropped ones by reason. A row is used whole or not at all."""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.tabular.clock import longest_increasing, sessions, unwrapped
from oio.tabular.layout import Layout
from oio.tabular.rows import Cells, read_cells
from oio.tabular.text import Text

SENTINEL = 4294967295.0  # 2^32 - 1: unsigned -1, sent by firmware for a missing sensor
LARGEST = 1e12  # of a measurement in any unit; what is beyond is rubbish on the line
LATEST_S = 1e11  # no time stamp is 3000 years from its epoch; beyond, nanoseconds overflow
Span = tuple[float, float]


@dataclass(frozen=True)
class Wanted:
    """Columns to read. The first `gas` of `columns` are readings, to which `saturated` and `no_value` apply."""

    time: str | None  # None: rows are numbered
    stamp: Callable[[str], float]  # converts a cell to seconds; raises ValueError
    columns: tuple[str, ...]
    gas: int
    saturated: float = np.inf  # a value this high is the end of the sensor's scale, not a measurement
    no_value: tuple[Span, ...] = ()
    wrap_s: float | None = None  # duration after which the clock begins anew by itself
    max_gap_s: float | None = None  # a longer gap begins a new session
    session: int | None = 0  # 0: all rows are one; None: there must be only one; else its number from 1


@dataclass(frozen=True, eq=False)
class Table:
    """Usable rows: t_s (k,) s, strictly increasing from 0; values (k, m), all finite; dropped: reason -> rows.

    `start_s` is the first usable time stamp.
    """

    start_s: float
    t_s: Array
    values: Array
    dropped: Mapping[str, int]
    overflows: int = 0


def read_table(source: Text, layout: Layout, wanted: Wanted, cells: Cells | None = None) -> Table:
    """Read the usable rows, from `cells` if they were read. Raises BadInput for missing columns, too few rows, or sessions to choose."""
    cells = cells or read_cells(source, layout, wanted.time, wanted.stamp, wanted.columns)
    dropped = Counter(cells.other)
    bad = unusable(cells.values, wanted)
    for reason, which in bad.items():
        dropped[reason] += int(np.count_nonzero(which))
    good: NDArray[np.bool_] = ~np.logical_or.reduce(list(bad.values()))
    rows: Array = cells.values[good]
    t_s, overflows = unwrapped(rows[:, 0], wanted.wrap_s)
    rows = np.column_stack((t_s, rows[:, 1:]))
    chosen = _session(source.name, rows, wanted)
    dropped["of another session"] = len(rows) - len(chosen)
    increasing = longest_increasing(chosen[:, 0].tolist())
    dropped["out of order"] = len(chosen) - len(increasing)
    dropped = +dropped
    if len(increasing) < 2:
        total = len(cells.values) + sum(cells.other.values())
        raise BadInput(
            f"{source.name} has {len(increasing)} usable rows of {total} (dropped: {dict(dropped)}), but at least 2 are needed. "
            f"Type python -m oio.inspect {source.name}"
        )
    t_s = chosen[increasing, 0]
    return Table(float(t_s[0]), t_s - t_s[0], chosen[increasing, 1:], dict(dropped), overflows)


def unusable(values: Array, wanted: Wanted) -> dict[str, NDArray[np.bool_]]:
    """Return, for each reason to drop rows of (k, 1 + m) values, which ones (k,); a row has one reason."""
    gas = values[:, 1 : 1 + wanted.gas]
    no_number = ~np.all(np.isfinite(values), axis=1)
    found = {"not a number": no_number}
    found["too large for a measurement"] = np.any(np.abs(values[:, 1:]) > LARGEST, axis=1)
    found["without a time"] = np.abs(values[:, 0]) > LATEST_S
    without = np.any(values[:, 1:] == SENTINEL, axis=1)
    for low, high in wanted.no_value:
        without |= np.any((gas >= low) & (gas <= high), axis=1)
    found["without a sensor"] = without
    found["saturated"] = np.any(gas >= wanted.saturated, axis=1)
    taken = np.zeros(len(values), dtype=bool)
    for reason, rows in found.items():
        found[reason] = rows & ~taken
        taken |= rows
    return found


def _session(name: str, rows: Array, wanted: Wanted) -> Array:
    """Return the rows of the chosen session."""
    if wanted.session == 0 or len(rows) < 2:
        return rows
    number = sessions(rows[:, 0], wanted.max_gap_s)
    sizes = np.bincount(number)
    chosen = 1 if wanted.session is None and len(sizes) == 1 else wanted.session
    if chosen is None or not 1 <= chosen <= len(sizes):
        listed = ", ".join(f"{i + 1}: {size} rows" for i, size in enumerate(sizes[:9])) + (", ..." if len(sizes) > 9 else "")
        said = "none was chosen" if chosen is None else f"recording.session is {chosen}"
        raise BadInput(
            f"{name} has {len(sizes)} sessions between which its clock was set back{_or_gap(wanted)} ({listed}), but {said}: how much time "
            f"passed between them is not in the file. Type recording.session={int(np.argmax(sizes)) + 1} for the longest."
        )
    kept: Array = rows[number == chosen - 1]
    return kept


def _or_gap(wanted: Wanted) -> str:
    return "" if wanted.max_gap_s is None else f", or after a gap of more than {wanted.max_gap_s:g} s"
