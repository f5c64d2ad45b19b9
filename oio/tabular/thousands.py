"""Marks before exactly three digits: 1,012 may be a thousand and twelve, or a little more than one. Where a file does not say, it is
refused."""

import csv
import re
from collections.abc import Iterable, Sequence
from itertools import islice

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.tabular.layout import SAMPLE, Layout, is_number, places, splitter
from oio.tabular.text import Text, lines

GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}[.,]\d{3}$")  # 1,012: the one case that is open
GROUPS = re.compile(r"[+-]?\d{1,3}([.,'’ \u00a0\u202f])\d{3}(\1\d{3})*([.,]\d+)?$")  # 1.437,5 and 1'012, which are no numbers otherwise
LEAST_UNLIKELY = 100.0  # 412.250 is hardly 412 thousand
TELLING = 100.0  # a whole number from here on, beside marks before three digits, is of a column that goes on above 999


def refuse_thousands(source: Text, layout: Layout, columns: Sequence[str], values: Array) -> None:
    """Raise BadInput if marks of thousands may stand in `columns`, whose numbers (k, m) as they were read are `values`."""
    for column, numbers in zip(columns, values.T, strict=True):
        if np.any(np.isnan(numbers)) and (found := _first(GROUPS, _cells(source, layout, column))):
            raise BadInput(
                f"{source.name} has values such as {found} in '{column}', with marks between thousands, and they are no numbers as they "
                f"stand. Export it without marks between thousands."
            )
        if _looks_open(numbers):
            refuse_open(source, column, _cells(source, layout, column), TELLING)
        if _all_grouped(numbers):
            _refuse_all_grouped(source, layout, column)


def refuse_open(source: Text, column: str, cells: Iterable[str], least: float) -> None:
    """Raise BadInput if all marks in the cells stand before exactly three digits, and whole numbers from `least` on have none."""
    whole, marked = 0.0, []
    for cell in (cell.strip() for cell in cells):
        if cell.isascii() and cell.isdigit():
            whole = max(whole, float(cell) + 1.0)
        elif "." in cell or "," in cell:
            if not GROUPED.match(cell):
                return
            marked.append(cell)
    if marked and whole > least:
        mark = "," if "," in marked[0] else "."
        raise BadInput(
            f"{source.name} has values such as {marked[0]} in '{column}' beside whole numbers up to {whole - 1.0:g}, and it is not certain "
            f"whether the mark is between thousands or a decimal mark. Export it without marks between thousands; or, if it is a decimal "
            f"mark, type recording.decimal='\"{mark}\"'."
        )


def _refuse_all_grouped(source: Text, layout: Layout, column: str) -> None:
    """Raise BadInput if every cell of a column is like 1.413, and nothing else in the file tells what that mark is."""
    marked = ""
    for cell in _cells(source, layout, column):
        if cell.isdigit() or (("." in cell or "," in cell) and not GROUPED.match(cell)):
            return
        marked = cell if GROUPED.match(cell) else marked
    mark = "," if "," in marked else "."
    others = (cell for column in layout.names for cell in islice(_cells(source, layout, column), SAMPLE) if mark in cell)
    if marked and not any(is_number(cell, mark) and not GROUPED.match(cell) for cell in others):
        raise BadInput(
            f"{source.name} has values such as {marked} in '{column}', all with three digits behind the mark, and it is not certain "
            f"whether that is between thousands or a decimal mark. If it is a decimal mark, type "
            f"recording.decimal='\"{mark}\"'; if not, export it without marks between thousands."
        )


def _all_grouped(numbers: Array) -> bool:
    """Whether all numbers (k,) may be thousands that were read as thousandths, none of a hundred thousand or more."""
    finite = np.abs(numbers[np.isfinite(numbers)])
    if not len(finite) or finite.min() < 1.0 or finite.max() >= LEAST_UNLIKELY or np.all(finite == np.floor(finite)):
        return False
    return bool(np.allclose(1e3 * finite, np.rint(1e3 * finite), rtol=0.0, atol=1e-6))


def _looks_open(numbers: Array) -> bool:
    """Whether numbers (k,) may be thousands that were read as thousandths: a quick look before the text is read again."""
    finite = np.abs(numbers[np.isfinite(numbers)])
    is_whole = finite == np.floor(finite)
    parts = finite[~is_whole]
    if not len(parts) or len(parts) == len(finite) or finite[is_whole].max() < TELLING:
        return False
    return bool(parts.min() >= 1.0 and parts.max() < 1000.0 and np.allclose(1e3 * parts, np.rint(1e3 * parts), rtol=0.0, atol=1e-6))


def _cells(source: Text, layout: Layout, column: str) -> Iterable[str]:
    split, (place, *_) = splitter(layout.delimiter), places(layout, column)
    for match in lines(source.text, layout.data_at):
        try:
            cells = split(match[0])
        except csv.Error:
            continue
        if len(cells) > place:
            yield cells[place].strip()


def _first(pattern: re.Pattern[str], cells: Iterable[str]) -> str | None:
    return next((cell for cell in cells if pattern.match(cell)), None)
