"""Layout of a table: delimiter, decimal mark, and the header. What is not given is read off the first lines."""

import csv
import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice

from oio.core.errors import BadInput
from oio.tabular.mapping import typed
from oio.tabular.names import UNITS, squeezed, unit_of
from oio.tabular.text import Text, lines

DELIMITERS = (",", ";", "\t", "|", " ")
WORDS = {"\t": "tab", " ": "blanks"}
SAMPLE = 400  # lines by which the layout is judged
CLEAR = 0.1  # by how much the best delimiter must be better than the next
POINT, COMMA = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?$"), re.compile(r"[+-]?(\d+,?\d*|,\d+)([eE][+-]?\d+)?$")
CLOCK = re.compile(r"\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4}([T ].*)?$|\d{1,2}:\d{2}(:\d{2})?([.,]\d+)?( ?[AaPp][Mm])?$")
FORMAT = re.compile(r"[-/:., YyMmDdHhTtSsZzf%]*")  # cells of a row of units below dates: YYYY-MM-DD hh:mm:ss, or nothing
UNIT_CELL = re.compile(r"([+-]?\d[\d.,]*(?:[eE][+-]?\d+)?)\s*([^\s\d.,+-][^\s,;|\t\"]*)")  # 410 ppm, 21.5°C
BOTH = " + "  # between the names of two columns that are read as one: Date + Time
EMPTY = {"", "nan", "na", "n/a", "null", "none", "-", "inf", "-inf"}


@dataclass(frozen=True)
class Layout:
    """Delimiter (`\\t` for tabs, a blank for any blanks), decimal mark, names of the columns, and where the data begins in the text."""

    delimiter: str
    decimal: str
    names: tuple[str, ...]
    header: str  # the line of the header, empty if there is none
    data_at: int  # position in the text behind the header
    preamble: int  # lines above it


def splitter(delimiter: str) -> Callable[[str], list[str]]:
    """Return the function that splits a line into cells; quoted cells may hold the delimiter. It raises csv.Error for what it cannot."""
    if delimiter == " ":
        return str.split

    def split(line: str) -> list[str]:
        return next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), []) if '"' in line else line.split(delimiter)

    return split


def places(layout: "Layout", column: str) -> tuple[int, ...]:
    """Return where the cells of a column are: one, or two for `Date + Time`. Raises KeyError with the name that does not exist."""
    names = (column,) if column in layout.names else tuple(column.split(BOTH))
    for name in names:
        if name not in layout.names:
            raise KeyError(name)
    return tuple(layout.names.index(name) for name in names)


def is_number(cell: str, decimal: str = ".") -> bool:
    """Whether a cell is a number with this decimal mark."""
    return (POINT if decimal == "." else COMMA).match(cell) is not None


def find_layout(source: Text, delimiter: str | None = None, decimal: str | None = None, time: str | None = None) -> Layout:
    """Return the layout; None is read off the file. `time`: a name that the header must hold. Raises BadInput for what is no table.

    Without a line of names the columns are called `column 1`, `column 2`...
    """
    sample = [match[0] for match in islice(lines(source.text), SAMPLE)]
    if len(sample) < 2:
        raise BadInput(f"{source.name} is no table: it has {len(sample)} lines with text.")
    best = delimiter or source.delimiter or find_delimiter(source.name, sample)
    rows = [cells_of(line, best) for line in sample]
    mark = decimal or _decimal(source.name, rows)
    return _header(source, best, mark, time, Counter(map(len, rows)).most_common(1)[0][0])


def cells_of(line: str, delimiter: str) -> list[str]:
    """Cells of a line without blanks, quotes and marks of comments around them; none, if it cannot be split."""
    try:
        return [cell.strip(' "#\t') for cell in splitter(delimiter)(line)]
    except csv.Error:
        return []


def find_delimiter(name: str, sample: Sequence[str]) -> str:
    """Delimiter of the lines of a file. Raises BadInput if there is none, or if it is not certain."""
    scores = sorted(((_score(sample, delimiter), delimiter) for delimiter in DELIMITERS), reverse=True)
    if scores[0][1] == " " and scores[1][0] > 0.5 * scores[0][0]:
        del scores[0]  # blanks stand in dates and names, too
    (first, best), (second, other) = scores[:2]
    if first == 0.0:
        if sum(is_number(line.strip()) for line in sample) > 0.9 * len(sample) - 1:
            return ","  # one column of numbers
        raise BadInput(
            f"{name} is no table: no delimiter (comma, semicolon, tab, bar, blanks) splits its lines into the same number of cells."
        )
    if other != " " and first - second < CLEAR * first:
        words = [WORDS.get(one, one) for one in (best, other)]
        raise BadInput(
            f"{name} can be split by '{words[0]}' or by '{words[1]}', and it is not certain which. Type {typed('delimiter', best)}."
        )
    return best


def _score(sample: Sequence[str], delimiter: str) -> float:
    """Share of the lines that have the most frequent number of cells, times the share of their cells that are values."""
    rows = [cells_of(line, delimiter) for line in sample]
    width, count = Counter(map(len, rows)).most_common(1)[0]
    if width < 2:
        return 0.0
    cells = [cell for row in rows if len(row) == width for cell in row]
    values = sum(_is_value(cell) or cell.lower() in EMPTY for cell in cells)
    return count / len(rows) * values / len(cells)


def _is_value(cell: str) -> bool:
    united = UNIT_CELL.fullmatch(cell)
    return is_number(cell) or is_number(cell, ",") or CLOCK.match(cell) is not None or (united is not None and _unit(united[2]) is not None)


def _decimal(name: str, rows: Sequence[Sequence[str]]) -> str:
    commas = sum("," in cell and is_number(cell, ",") for row in rows for cell in row)
    points = sum("." in cell and is_number(cell) for row in rows for cell in row)
    if min(commas, points) > 0.02 * max(commas, points):
        raise BadInput(
            f"{name} has {commas} numbers with a decimal comma and {points} with a point among its first lines, and it is not "
            f"certain which is the decimal mark. Type recording.decimal='\",\"' or recording.decimal='\".\"': the others are dropped."
        )
    return "," if commas > points else "."


def _header(source: Text, delimiter: str, decimal: str, time: str | None, width: int) -> Layout:
    seen: list[str] = []
    for i, match in enumerate(lines(source.text)):
        cells = cells_of(match[0], delimiter)
        seen = seen or cells
        if time is not None and not time.startswith("column "):
            names, data_at = _with_units(source, cells, match.end(), delimiter)
            if time in names or all(name in names for name in time.split(BOTH)):
                return Layout(delimiter, decimal, names, match[0], data_at, i)
            continue
        if len(cells) != width:
            continue
        if any(is_number(cell, decimal) or CLOCK.match(cell) for cell in cells):  # values: there was no header
            return Layout(delimiter, decimal, tuple(f"column {j + 1}" for j in range(width)), "", match.start(), i)
        if sum(map(bool, cells)) > width / 2:
            names, data_at = _with_units(source, cells, match.end(), delimiter)
            return Layout(delimiter, decimal, names, match[0], data_at, i)
    if time is not None and (named := _named(source, delimiter, decimal, width)):
        raise BadInput(
            f"{source.name} has no column {[time]}. Its columns are {list(named)}; choose among them, e.g. {typed('columns', named[-1:])}."
        )
    wanted = f"no line names the column '{time}'" if time else f"no line of {width} cells names its columns"
    raise BadInput(f"{source.name} has no header: {wanted}. Its first line is {seen!r:.200}.")


def _with_units(source: Text, cells: Sequence[str], end: int, delimiter: str) -> tuple[tuple[str, ...], int]:
    """Names of the columns, with the units of the row below if it is one of units; and where the data begins."""
    below = next(lines(source.text, end), None)
    row = [] if below is None else [cell.strip("[]()") for cell in cells_of(below[0], delimiter)]
    if (
        below is None
        or len(row) != len(cells)
        or not any(map(_unit, row))
        or not all(_unit(cell) or FORMAT.fullmatch(cell) for cell in row)
    ):
        return unique(cells), end
    for name, cell in zip(cells, row, strict=True):
        if _unit(cell) and (said := unit_of(name)) not in (None, _unit(cell)):
            raise BadInput(
                f"{source.name} has a column '{name}', by its name in {said}, but by the row below in {cell}. Correct one of them."
            )
    named = [f"{name} [{cell}]" if _unit(cell) and unit_of(name) is None else name for name, cell in zip(cells, row, strict=True)]
    return unique(named), below.end()


def _unit(cell: str) -> str | None:
    return UNITS.get(squeezed(cell))


def _named(source: Text, delimiter: str, decimal: str, width: int) -> tuple[str, ...]:
    """Names in the header, whichever they are; none if there is none."""
    try:
        found = _header(source, delimiter, decimal, None, width)
    except BadInput:
        return ()
    return found.names if found.header else ()


def unique(cells: Sequence[str]) -> tuple[str, ...]:
    """Names of columns, where a name that comes again is numbered: CO2, CO2 #2."""
    times: Counter[str] = Counter()
    named = []
    for i, cell in enumerate(cells):
        name = cell or f"column {i + 1}"
        times[name] += 1
        named.append(name if times[name] == 1 else f"{name} #{times[name]}")
    return tuple(named)
