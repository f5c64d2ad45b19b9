"""Rows of a table, all of them: their cells as numbers, and a count of what is no row."""

import csv
from array import array
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.tabular.layout import SAMPLE, Layout, is_number, places, splitter, unique
from oio.tabular.mapping import typed
from oio.tabular.text import Text, lines

NAN = float("nan")
FEW = 9  # rows before the last, below which nothing is said of the usual length of a cell


@dataclass(frozen=True, eq=False)
class Cells:
    """Values (k, 1 + m) of all rows of the right width, time first [s], NaN where there is no number; and the other rows by reason."""

    values: Array
    other: Mapping[str, int]


def read_cells(
    source: Text,
    layout: Layout,
    time: str | None,
    stamp: Callable[[str], float],
    columns: Sequence[str],
    only: tuple[str, str] | None = None,
) -> Cells:
    """Read columns of all rows; `time` None: the number of the row takes its place; `only`: rows that have this value in this column.

    Raises BadInput for a column that does not exist.
    """
    stamped = _places(source.name, layout, () if time is None else (time,))
    used, chosen = _places(source.name, layout, columns), _places(source.name, layout, () if only is None else only[:1])
    split, width, comma = splitter(layout.delimiter), len(layout.names), layout.decimal == ","
    values, other = array("d"), Counter[str]()
    shortest = len(source.text)  # of the last cells
    for number, match in enumerate(lines(source.text, layout.data_at), start=1):
        try:
            cells = split(match[0])
        except csv.Error:
            cells = []
        reason = _reason(match[0], cells, width, layout)
        if cells and reason != "repeated header" and not cells[0][:1].isdigit():
            _refuse_other_header(source.name, layout, cells, number)
        if not reason and number > FEW and match.end() == len(source.text) and _is_cut(source.text, cells, shortest):
            reason = "cut at the end of the file"
        if not reason and only is not None and cells[chosen[0]].strip(' "') != only[1]:
            reason = "of another device"
        if reason:
            other[reason] += 1
            continue
        shortest = min(shortest, len(cells[width - 1]))
        values.append(_value(" ".join([cells[i] for i in stamped]) if stamped else str(number), stamp))
        values.extend([_number(cells[i].replace(",", ".") if comma else cells[i]) for i in used])
    return Cells(np.array(values).reshape(-1, 1 + len(columns)), other)


def sample(source: Text, layout: Layout, column: str) -> list[str]:
    """Return the cells of a column in the first rows."""
    split, used, cells = splitter(layout.delimiter), places(layout, column), []
    for match in islice(lines(source.text, layout.data_at), SAMPLE):
        try:
            row = split(match[0])
        except csv.Error:
            continue
        if len(row) >= len(layout.names) and match[0] != layout.header:
            cells.append(" ".join(row[i] for i in used))
    return cells


def with_numbers(source: Text, layout: Layout) -> Layout:
    """The layout with the names of those columns alone that hold numbers in the first rows; all, if none does."""
    held = tuple(name for name in layout.names if any(is_number(cell.strip(' "'), layout.decimal) for cell in sample(source, layout, name)))
    return replace(layout, names=held) if held else layout


def without_numbers(source: Text, layout: Layout) -> dict[str, str]:
    """The columns that hold no number in the first rows, each with one of its cells; empty ones are left out."""
    held = with_numbers(source, layout).names
    cells = {name: [cell.strip() for cell in sample(source, layout, name) if cell.strip(' "')] for name in layout.names if name not in held}
    return {name: found[0] for name, found in cells.items() if found}


def _places(name: str, layout: Layout, columns: Sequence[str]) -> list[int]:
    try:
        return [place for column in columns for place in places(layout, column)]
    except KeyError as missing:
        raise BadInput(
            f"{name} has no column {[missing.args[0]]}. Its columns are {list(layout.names)}; choose among them, e.g. "
            f"{typed('columns', layout.names[-1:])}."
        ) from None


def _reason(line: str, cells: Sequence[str], width: int, layout: Layout) -> str:  # why a row is none, empty if it is one
    if len(cells) != width:
        if len(cells) == width + 1 and not cells[-1].strip():  # a delimiter behind the last cell
            return ""
        return "short" if len(cells) < width else "long"
    if line == layout.header:
        return "repeated header"
    return "repeated" if cells[0].strip() == "end" else ""  # some loggers repeat each sample in a row of its own


def _refuse_other_header(name: str, layout: Layout, cells: Sequence[str], number: int) -> None:
    """Raise BadInput if a row names the columns anew, but not as they were: what follows it would be read into the wrong ones."""
    named = unique([cell.strip(' "#\t') for cell in cells])
    if named != layout.names and sum(cell in layout.names for cell in named) >= 2 and not any(map(is_number, named)):
        raise BadInput(
            f"{name} names its columns again in row {number} below its header, and otherwise: {list(named)} instead of "
            f"{list(layout.names)}. Cut the file there, and give one part at a time."
        )


def _is_cut(text: str, cells: Sequence[str], shortest: int) -> bool:
    """Whether the last row has no end of line, and its last cell is shorter than any before: a logger that lost its power."""
    return text[-1:] not in "\r\n" and len(cells[-1]) < shortest


def _value(cell: str, convert: Callable[[str], float]) -> float:
    try:
        return convert(cell)
    except (ValueError, OverflowError):
        return NAN


def _number(cell: str) -> float:
    try:
        return NAN if "_" in cell else float(cell)  # Python alone reads 1_000 as a number
    except ValueError:
        return NAN
