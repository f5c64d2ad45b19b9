"""Parser of delimited text files of instruments: the usable rows, and a count of the dropped ones by reason."""

import math
import re
from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array

SENTINEL = 4294967295.0  # 2^32 - 1: unsigned -1, sent by firmware for a missing sensor
LATEST_S = 1e11  # no time stamp is 3000 years from its epoch; beyond, nanoseconds overflow


@dataclass(frozen=True)
class TextFormat:
    """File format: encoding, separator, the time column and its parser, the value columns."""

    encoding: str
    separator: str
    time: str
    stamp: Callable[[str], float]  # converts a cell to seconds; raises ValueError
    columns: tuple[str, ...]
    saturated: float  # a value this high is the end of the sensor's scale, not a measurement


@dataclass(frozen=True, eq=False)
class Table:
    """Usable rows: t_s (k,) s, strictly increasing from 0; values (k, m), all finite; dropped: reason -> rows.

    `start_s` is the first usable time stamp.
    """

    start_s: float
    t_s: Array
    values: Array
    dropped: Mapping[str, int]


def read_table(data: bytes, form: TextFormat, where: str) -> Table:
    """Parse `data` into its usable rows; a row is used whole or not at all. Raises BadInput for missing columns or too few usable rows.

    Lines may end in CR, LF or both, and text may stand above the header.
    """
    lines = [line for line in re.split(r"[\r\n]+", data.decode(form.encoding, errors="replace")) if line.strip()]
    first, width, used = _header(lines, form, where)
    read = [_row(line, form, width, used) for line in lines[first:]]
    dropped = Counter(row for row in read if isinstance(row, str))
    rows = np.array([row for row in read if not isinstance(row, str)]).reshape(-1, len(used))
    increasing = _longest_increasing(rows[:, 0].tolist())
    if len(increasing) < len(rows):
        dropped["out of order"] = len(rows) - len(increasing)
    if len(increasing) < 2:
        raise BadInput(f"{where} has {len(increasing)} usable rows of {len(read)} (dropped: {dict(dropped)}), but at least 2 are needed.")
    t_s = rows[increasing, 0]
    return Table(float(t_s[0]), t_s - t_s[0], rows[increasing, 1:], dict(dropped))


def _header(lines: Sequence[str], form: TextFormat, where: str) -> tuple[int, int, list[int]]:  # next line, width, used cells
    for i, line in enumerate(lines):
        cells = _cells(line, form)
        if form.time not in cells:
            continue
        missing = [column for column in form.columns if column not in cells]
        if missing:
            raise BadInput(f"{where} has no column {missing}. Its columns are {cells}; choose among them, e.g. recording.columns=[...].")
        return i + 1, len(cells), [cells.index(column) for column in (form.time, *form.columns)]
    raise BadInput(f"{where} has no header: no line names the column '{form.time}'. Its first line is {lines[:1]!r:.200}.")


def _cells(line: str, form: TextFormat) -> list[str]:
    return [cell.strip(' "#\t') for cell in line.split(form.separator)]


def _row(line: str, form: TextFormat, width: int, used: Sequence[int]) -> list[float] | str:  # values, or the reason why the row is dropped
    cells = _cells(line, form)
    if cells[0] == "end":  # some loggers repeat each sample in a row of its own
        return "repeated"
    if len(cells) != width:
        return "short" if len(cells) < width else "long"
    try:
        row = [form.stamp(cells[used[0]]), *(float(cells[i]) for i in used[1:])]
    except ValueError:
        return "not a number"
    return _drop_reason(row, form) or row


def _drop_reason(row: Sequence[float], form: TextFormat) -> str:  # reason to drop the row, empty if there is none
    if not all(map(math.isfinite, row)):
        return "not a number"
    if abs(row[0]) > LATEST_S:
        return "without a time"
    if SENTINEL in row[1:]:
        return "without a sensor"
    return "saturated" if max(row[1:]) >= form.saturated else ""


def _longest_increasing(stamps: Sequence[float]) -> list[int]:
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
