"""Table of cell centres and wind, as CFD programs write it: one of the families of column names below, in any order, others beside them.

Names may carry units, as `X (m)` or `Velocity u [ m s^-1 ]`; without units they are m and m/s. Cells are separated by commas, semicolons,
tabs or blanks; lines above the header, and a `#` or `%` before it, are passed over. What is not clear is refused, never guessed.
"""

import csv
import functools
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from hardware.air.air_recording import bad_file
from hardware.air.units import UNITS, factor
from oio.core.records import Array
from oio.tabular.text import decode

PLACES = tuple(  # in lower case; each triple is one family
    tuple(pattern.format(axis=axis, i=i) for i, axis in enumerate("xyz"))
    for pattern in (
        "points:{i}",
        "points_{i}",
        "points_{axis}",
        "{axis}",
        "{axis}-coordinate",
        "centroid[{axis}]",
        "cellcenters:{i}",
        "c{axis}",
    )
)
WINDS = tuple(
    tuple(pattern.format(axis=axis, i=i, ijk="ijk"[i], uvw="uvw"[i]) for i, axis in enumerate("xyz"))
    for pattern in (
        "u:{i}", "u_{i}", "u_{axis}", "u{axis}", "umean:{i}", "velocity:{i}", "velocity_{i}", "velocity[{ijk}]", "velocity {uvw}",
        "velocity in stn frame {uvw}", "{axis}-velocity", "v{axis}", "{uvw}",
    )
)  # fmt: skip
HEADER_LINES = 50  # the header is among the first
Split = Callable[[str], list[str]]


def read_cell_table(path: Path) -> Array:
    """Places and wind (n, 6) [m, m/s]; raises BadInput that says what is wrong, and in which line."""
    lines = decode(path.read_bytes(), None, str(path)).text.splitlines()
    at, split = _header(path, lines)
    header = split(lines[at].lstrip("#% "))
    columns = _columns(path, header)
    rows = [(number, cells) for number, line in enumerate(lines[at + 1 :], at + 2) if (cells := _filled(split(line)))]
    wanted, width = [i for i, _ in columns], len(_filled(header))
    for number, cells in rows:
        if len(cells) > width or len(cells) <= max(wanted):
            raise bad_file(path, f"line {number} has {len(cells)} cells, but its header names {width}")
    values = np.array([[_number(path, number, cells[i]) for i in wanted] for number, cells in rows]).reshape(-1, 6)
    bad = int(np.sum(~np.all(np.isfinite(values), axis=1)))
    if bad:
        raise bad_file(path, f"{bad} of {len(values)} rows have values that are not finite; leave them out of the export")
    return np.asarray(values * [unit for _, unit in columns])


def _header(path: Path, lines: list[str]) -> tuple[int, Split]:
    """Index of the line that names places and wind, and how it and the lines below it are split."""
    nearly: list[str] = []
    for number, line in enumerate(lines[:HEADER_LINES]):
        for split in _splits(line):
            names = [_name_and_unit(cell)[0] for cell in split(line.lstrip("#% "))]
            places, winds = ([family for family in families if set(family) & set(names)] for families in (PLACES, WINDS))
            if any(set(family) <= set(names) for family in places) and any(set(family) <= set(names) for family in winds):
                return number, split
            nearly += [_missing(number, names, families) for families in (places, winds) if len(families) and len(names) > 3]
    first = lines[0].strip()[:120] if lines else ""
    seen = "; ".join(text for text in dict.fromkeys(nearly) if text) or f"the first is '{first}'"
    raise bad_file(path, f"no line names the places x, y, z and the wind u, v, w, as Points:0 and U:0 of ParaView do; {seen}")


def _missing(number: int, names: list[str], families: list[tuple[str, ...]]) -> str:
    best = max(families, key=lambda family: len(set(family) & set(names)))
    lacks = [name for name in best if name not in names]
    return f"line {number + 1} lacks {', '.join(lacks)}" if lacks and len(lacks) < 3 else ""


def _splits(line: str) -> list[Split]:
    """The ways in which a line might be split, likeliest first."""
    found = [functools.partial(_by_delimiter, delimiter) for delimiter in (",", ";", "\t") if delimiter in line]
    return [*found] or [_by_blanks]


def _by_delimiter(delimiter: str, text: str) -> list[str]:
    return next(csv.reader([text], delimiter=delimiter, skipinitialspace=True), [])


def _by_blanks(text: str) -> list[str]:
    """Words; quotes and brackets with a unit keep theirs together."""
    return [word.strip('"') for word in re.findall(r'"[^"]*"|\S+(?:\s+[\[(][^\])]*[\])])?', text)]


def _filled(cells: list[str]) -> list[str]:
    """Cells without the empty ones at the end."""
    while cells and not cells[-1].strip():
        cells = cells[:-1]
    return cells


def _number(path: Path, line: int, cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        hint = "; export with decimal points" if re.fullmatch(r"\s*-?\d+,\d+\s*", cell) else ""
        raise bad_file(path, f"line {line} has '{cell.strip()[:40]}' where its header has a number{hint}") from None


def _columns(path: Path, header: list[str]) -> list[tuple[int, float]]:
    """Index and factor to m or m/s of x, y, z, u, v, w. Refuses two families of one kind: which one is meant cannot be told."""
    named = [_name_and_unit(cell) for cell in header]
    names, found = [name for name, _ in named], []
    for kind, families in (("length", PLACES), ("speed", WINDS)):
        whole = [family for family in families if set(family) <= set(names)]
        if len(whole) > 1:
            first, second = whole[0][0], whole[1][0]
            raise bad_file(path, f"its columns '{first}' and '{second}' could both be meant; leave one of them, and its like, out")
        for name in whole[0]:
            if names.count(name) > 1:
                raise bad_file(path, f"two of its columns are named '{name}', if capitals do not count; leave one out")
            i = names.index(name)
            found.append((i, factor(kind, named[i][1] or next(iter(UNITS[kind])), f"{path}: column '{header[i].strip()}'")))
    return found


def _name_and_unit(cell: str) -> tuple[str, str]:
    """Name in lower case, and the unit in its last brackets, "" if there is none: those of `velocity[i]` belong to the name."""
    name = " ".join(cell.strip().strip('"').split()).lower()
    split = re.fullmatch(r"(.+?) ?[\[(] ?([^\[\]()]*?) ?[\])]", name)
    if split is None or any(name in family for family in (*PLACES, *WINDS)):
        return name, ""
    return split[1], split[2]
