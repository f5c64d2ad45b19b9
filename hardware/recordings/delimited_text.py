"""Reads the delimited text that instruments leave behind: the rows that can be used, and a count of the others by reason."""

import math
import re
from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array

SENTINEL = 4294967295.0  # 2^32 - 1: firmware that sends an unsigned -1 for "no sensor"
LATEST_S = 1e11  # no stamp is 3000 years from its epoch; beyond, nanoseconds overflow


@dataclass(frozen=True)
class TextFormat:
    """How a file is written: encoding, separator, the column of the stamps and how one reads, the columns of the values."""

    encoding: str
    separator: str
    time: str
    stamp: Callable[[str], float]  # a cell to seconds; raises ValueError
    columns: tuple[str, ...]
    saturated: float  # a value this high is the end of the sensor's scale, not a measurement


@dataclass(frozen=True, eq=False)
class Table:
    """The usable rows: t_s (k,) s, strictly rising from 0; values (k, m), all finite; dropped: reason -> rows.

    `start_s` is what the first usable stamp said.
    """

    start_s: float
    t_s: Array
    values: Array
    dropped: Mapping[str, int]


def read_table(data: bytes, form: TextFormat, where: str) -> Table:
    """The usable rows of `data`; a row counts whole or not at all. Raises BadInput if columns are missing or no two rows are left.

    Lines may end in CR, LF or both, and text may stand above the header.
    """
    lines = [line for line in re.split(r"[\r\n]+", data.decode(form.encoding, errors="replace")) if line.strip()]
    first, width, picks = _header(lines, form, where)
    read = [_row(line, form, width, picks) for line in lines[first:]]
    dropped = Counter(row for row in read if isinstance(row, str))
    rows = np.array([row for row in read if not isinstance(row, str)]).reshape(-1, len(picks))
    rising = _rising(rows[:, 0].tolist())
    if len(rising) < len(rows):
        dropped["out of order"] = len(rows) - len(rising)
    if len(rising) < 2:
        raise BadInput(f"{where} has {len(rising)} usable rows of {len(read)} (dropped: {dict(dropped)}), but at least 2 are needed.")
    t_s = rows[rising, 0]
    return Table(float(t_s[0]), t_s - t_s[0], rows[rising, 1:], dict(dropped))


def _header(lines: Sequence[str], form: TextFormat, where: str) -> tuple[int, int, list[int]]:  # line after it, its width, wanted cells
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


def _row(line: str, form: TextFormat, width: int, picks: Sequence[int]) -> list[float] | str:  # numbers, or why there are none
    cells = _cells(line, form)
    if cells[0] == "end":  # some loggers repeat each sample in a row of its own
        return "repeated"
    if len(cells) != width:
        return "short" if len(cells) < width else "long"
    try:
        row = [form.stamp(cells[picks[0]]), *(float(cells[i]) for i in picks[1:])]
    except ValueError:
        return "not a number"
    return _flaw(row, form) or row


def _flaw(row: Sequence[float], form: TextFormat) -> str:  # empty if there is none
    if not all(map(math.isfinite, row)):
        return "not a number"
    if abs(row[0]) > LATEST_S:
        return "without a time"
    if SENTINEL in row[1:]:
        return "without a sensor"
    return "saturated" if max(row[1:]) >= form.saturated else ""


def _rising(stamps: Sequence[float]) -> list[int]:
    """Indices of the most rows whose stamps rise strictly: one wild stamp costs one row, not all that come after it.

    The longest increasing subsequence by patience sorting, O(k log k): lowest[j] ends the best chain of j + 1 rows so far.
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
