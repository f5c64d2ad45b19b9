"""Text that says the same as a table, as the text of one: lines that name their values, JSON, annotated InfluxDB, values with units."""

import json
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice

from oio.core.errors import BadInput
from oio.tabular.layout import SAMPLE, UNIT_CELL, cells_of, find_delimiter
from oio.tabular.names import UNITS, squeezed, unit_of
from oio.tabular.text import Text, lines

MOST, OFTEN = 0.8, 0.5  # share of the first lines that have a form, and of those lines that have its most frequent name
MARK = ";"  # between the cells of what is written anew
STAMP = re.compile(r"\s*\[?(\d[\d/.:,T +-]*Z?(?: ?[AaPp][Mm])?)\]?\s*(?:->|[,;|>\t])?\s*(?=[^\W\d])")
NAME = r'[,;|\t\s]*"?([^\W\d][^=:;,|\t"]*?)"?\s*[=:]\s*'
MOMENT = r"\d{4}-\d\d-\d\d(?:[T ]\d\d:\d\d(?::\d\d(?:\.\d+)?)?(?:Z|[+-]\d\d:?\d\d)?)?|\d{1,2}:\d\d(?::\d\d(?:\.\d+)?)?"
VALUE = r'([+-]?\d+(?:[.,]\d+)*(?:[eE][+-]?\d+)?(?![\d.:])|"[^"]*"|[^\s,;|\t=:"\d][^\s,;|\t=:"]*)'
PAIR = re.compile(rf"{NAME}(?:({MOMENT})(?![\d:])|{VALUE})")
UNIT = re.compile(r"\s*([^\s\d,;|\t=:\"]+)(?=[\s,;|\t]|$)(?!\s*[=:])")
ANNOTATION = re.compile(r'^"?#(group|datatype|default)\b[^\r\n]*[\r\n]*', re.MULTILINE)
LIST = re.compile(r"\s*\[\s*\{")  # of JSON, on one line or indented
Record = Mapping[str, str]


def as_table(source: Text, delimiter: str | None = None) -> Text:
    """Return the text as that of a table with one delimiter; most texts are returned as they are.

    Raises BadInput for a value whose unit changes from line to line.
    """
    source = _one_object_a_line(source)
    head = [match[0] for match in islice(lines(source.text), SAMPLE)]
    if ANNOTATION.match(source.text):
        return replace(source, text=ANNOTATION.sub("", source.text), form="annotated (InfluxDB)")
    if delimiter in (None, MARK):
        for form, read in (("JSON", _json_record), ("values with names", _named_record)):
            if _has_form(head, read):
                return _written(source, form, read)
    return _without_units(source, head, delimiter)


def _has_form(head: Sequence[str], read: Callable[[str], Record | None]) -> bool:
    records = [record for line in head if (record := read(line)) is not None]
    names = Counter(name for record in records for name in record)
    return len(records) >= max(MOST * len(head), 2) and bool(names) and names.most_common(1)[0][1] >= OFTEN * len(records)


def _written(source: Text, form: str, read: Callable[[str], Record | None]) -> Text:
    """The table of all records; a line that is none is a row of one cell, and so is counted where rows are."""
    records: list[Record | str] = [
        match[0].replace(MARK, " ") if (record := read(match[0])) is None else record for match in lines(source.text)
    ]
    units = _units(source.name, records)
    names = dict.fromkeys(name for record in records if not isinstance(record, str) for name in record if not name.endswith(UNIT_OF))
    titles = [name if name not in units or unit_of(name) else f"{name} [{units[name]}]" for name in names]
    rows = [record if isinstance(record, str) else MARK.join(record.get(name, "") for name in names) for record in records]
    return _with(source, [MARK.join(titles), *rows], form)


UNIT_OF = "\0unit"  # behind the name of a value, for its unit


def _units(name: str, records: Sequence[Record | str]) -> dict[str, str]:
    found: dict[str, str] = {}
    for number, record in enumerate(records, start=1):
        for key, unit in record.items() if not isinstance(record, str) else ():
            if not key.endswith(UNIT_OF):
                continue
            of = key.removesuffix(UNIT_OF)
            if UNITS[squeezed(found.setdefault(of, unit))] != UNITS[squeezed(unit)]:
                raise BadInput(f"{name} has '{of}' in {found[of]}, and from line {number} on in {unit}. Give a log in one unit.")
    return found


def _with(source: Text, rows: Sequence[str], form: str) -> Text:
    end = {"CR LF": "\r\n", "CR": "\r"}.get(source.line_ends, "\n")
    last = end if source.text[-1:] in "\r\n" else ""
    return replace(source, text=end.join(rows) + last, form=form, delimiter=MARK)


def _named_record(line: str) -> Record | None:
    """`12:00:01 -> CO2: 410 ppm, T=21`: the stamp before them is `time`; None if there is anything else."""
    record: dict[str, str] = {}
    at = 0
    if stamp := STAMP.match(line):
        record["time"], at = stamp[1].strip(" ,-"), stamp.end()
    while pair := PAIR.match(line, at):
        name = " ".join(pair[1].split())
        if name in record:
            return None
        record[name], at = (pair[2] or pair[3]).strip('"'), pair.end()
        if (unit := UNIT.match(line, at)) and squeezed(unit[1]) in UNITS:
            record[name + UNIT_OF], at = unit[1], unit.end()
    return record if at and not line[at:].strip(" ,;|\t}") and len(record) > ("time" in record) else None


def _one_object_a_line(source: Text) -> Text:
    if not LIST.match(source.text):
        return source
    try:
        objects = json.loads(source.text)
    except (ValueError, RecursionError):
        return source
    return replace(source, text="\n".join(map(json.dumps, objects)) + "\n")


def _json_record(line: str) -> Record | None:
    """`{"t": 1, "air": {"co2": 410}}`: the names of nested objects are joined by points."""
    text = line.strip().strip("[],")
    if not text.startswith("{"):
        return None
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return {name: " ".join(value.replace(MARK, " ").split()) for name, value in _flat("", found)} if isinstance(found, dict) else None


def _flat(name: str, value: object) -> Iterator[tuple[str, str]]:
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _flat(f"{name}.{key}" if name else str(key), inner)
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            yield from _flat(f"{name}[{i}]", inner)
    else:
        yield name, "" if value is None else value if isinstance(value, str) else json.dumps(value)


def _without_units(source: Text, head: Sequence[str], delimiter: str | None) -> Text:
    """`1 s,410 ppm,21 °C` becomes `1,410,21` below a row of units; cells with another unit stay as they are, and are no numbers."""
    if not head or sum(_has_unit(line) for line in head) < MOST * len(head):
        return source
    try:
        mark = delimiter or find_delimiter(source.name, head)
    except BadInput:
        return source
    rows = [cells_of(line, mark) for line in head]
    width = Counter(map(len, rows)).most_common(1)[0][0]
    units = [_common_unit([row[i] for row in rows if len(row) == width]) for i in range(width)]
    if mark == " " or not any(units):
        return source
    written: list[str] = []
    named = False
    for match in lines(source.text):
        cells = cells_of(match[0], mark)
        found = [UNIT_CELL.fullmatch(cell) if unit else None for unit, cell in zip(units, cells, strict=False)]
        if len(cells) != width or not any(found):
            written.append(match[0])
            continue
        if not named:
            written.append(mark.join(units))
            named = True
        plain = [one[1] if one and _known(one[2]) == _known(unit) else cell for one, unit, cell in zip(found, units, cells, strict=True)]
        written.append(mark.join(f'"{cell}"' if mark in cell else cell for cell in plain))
    return replace(_with(source, written, "values with units"), delimiter=mark)


def _has_unit(line: str) -> bool:
    return any(_known(found[2]) is not None for found in UNIT_CELL.finditer(line))


def _common_unit(cells: Sequence[str]) -> str:
    """The unit of most of these cells as it is written, or nothing."""
    full = [cell for cell in cells if cell]
    found = Counter(match[2] for cell in full if (match := UNIT_CELL.fullmatch(cell)) and _known(match[2]) is not None)
    unit, count = found.most_common(1)[0] if found else ("", 0)
    return unit if count >= MOST * len(full) else ""


def _known(word: str) -> str | None:
    return UNITS.get(squeezed(word))
