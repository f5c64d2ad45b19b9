"""A table read by a mapping: what is null in it is read off the file and said; what is not certain is refused with what to type."""

import csv
import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.tabular.layout import SAMPLE, Layout, find_layout, splitter
from oio.tabular.mapping import TableMapping
from oio.tabular.names import GAS_UNITS, role_of, unit_of
from oio.tabular.rows import Cells, Table, Wanted, read_cells, read_table
from oio.tabular.stamps import find_unit, stamp, wrap_s
from oio.tabular.text import Text, decode, lines

CODES = (-1.0, -99.0, -999.0, -9999.0, 32767.0, 65535.0, 2147483647.0)  # in which firmware says that it has no value
FAR = 3.0  # a code is suspicious if it is further from the next value than so many ranges of the others
KNOWN_PER_PPM = {"ppm": 1.0, "ppb": 1e3, "%vol": 1e-4}


@dataclass(frozen=True, eq=False)
class Read:
    """A table, the complete mapping by which it was read, and what of that was read off the file, as sentences."""

    table: Table
    mapping: TableMapping
    notes: tuple[str, ...]


def read_mapped(data: bytes, mapping: TableMapping, name: str) -> Read:
    """Read a file's bytes by a mapping. Raises BadInput for what is no table, and for what is null in the mapping and not certain."""
    source = decode(data, mapping.encoding, name)
    numbered = mapping.time_unit == "row"
    layout = find_layout(source, mapping.delimiter, mapping.decimal, _in_header(mapping))
    full, notes = complete(mapping, source, layout)
    columns = tuple(full.column_prefix + column for column in full.columns or ())
    wanted = Wanted(
        None if numbered else full.time, _stamp(full), (*columns, *(full.climate_columns or ())), len(columns),
        np.inf if full.saturated is None else full.saturated, full.no_value or (), wrap_s(full.time_unit or ""), full.max_gap_s, full.session,
    )  # fmt: skip
    cells = read_cells(source, layout, wanted.time, wanted.stamp, wanted.columns)
    if mapping.no_value is None:
        _refuse_codes(columns, cells)
    table = read_table(source, layout, wanted, cells)
    if table.overflows:
        notes = (*notes, f"the counter of '{full.time}' overflowed {table.overflows} times and was carried on")
    return Read(table, full, notes)


def _in_header(mapping: TableMapping) -> str | None:
    """A name that the header must hold."""
    return mapping.time or (mapping.column_prefix + mapping.columns[0] if mapping.columns else None)


def _stamp(mapping: TableMapping) -> Callable[[str], float]:
    period_s = mapping.period_s
    if period_s is not None:
        return lambda cell: float(cell) * period_s
    return stamp(mapping.time_unit or "s", mapping.decimal or ".")


def complete(mapping: TableMapping, source: Text, layout: Layout) -> tuple[TableMapping, tuple[str, ...]]:
    """Return the mapping without what is null, and what was found, as sentences. Raises BadInput where that is not certain."""
    notes = []
    found: dict[str, object] = {"encoding": source.encoding, "delimiter": layout.delimiter, "decimal": layout.decimal}
    words = [f"{key} {value!r}" for key, value in found.items() if getattr(mapping, key) is None]
    if words:
        notes.append("layout: " + ", ".join(words))
    if mapping.time_unit != "row":
        found["time"] = mapping.time or the_time(source.name, layout)
        found["time_unit"], reason = _time_unit(mapping, source, layout, str(found["time"]))
        if mapping.time is None or mapping.time_unit is None:
            notes.append(f"time: '{found['time']}' in {found['time_unit']}{reason}")
    found["columns"] = mapping.columns or the_gas(source.name, layout)
    if mapping.columns is None:
        notes.append(f"columns: {', '.join(found['columns'])}")  # type: ignore[arg-type]
    names = tuple(mapping.column_prefix + column for column in found["columns"])  # type: ignore[attr-defined]
    found["unit"], found["per_ppm"] = the_unit(mapping, names)
    if mapping.unit is None or (mapping.per_ppm is None and found["per_ppm"] != 1.0):
        notes.append(f"unit: {found['unit']}, {found['per_ppm']:g} per ppm")
    if mapping.climate_columns is None:
        found["climate_columns"] = climate(layout)
        notes.append(f"climate: {', '.join(found['climate_columns']) or 'none'}")  # type: ignore[arg-type]
    return dataclasses.replace(mapping, **{key: value for key, value in found.items()}), tuple(notes)  # type: ignore[arg-type]


def sample(source: Text, layout: Layout, column: str) -> list[str]:
    """Return the cells of a column in the first rows."""
    split, place, cells = splitter(layout.delimiter), layout.names.index(column), []
    for match in islice(lines(source.text, layout.data_at), SAMPLE):
        try:
            row = split(match[0])
        except csv.Error:
            continue
        if len(row) >= len(layout.names) and match[0] != layout.header:
            cells.append(row[place])
    return cells


def _time_unit(mapping: TableMapping, source: Text, layout: Layout, time: str) -> tuple[str, str]:
    if mapping.time_unit is not None:
        return mapping.time_unit, ""
    unit, reason = find_unit(time, unit_of(time), sample(source, layout, time) if time in layout.names else [], layout.decimal)
    return unit, f": {reason}"


def the_time(name: str, layout: Layout) -> str:
    """Return the only column that is named as a time. Raises BadInput if there are several, or none."""
    found = [column for column in layout.names if role_of(column) == "time"]
    if len(found) == 1:
        return found[0]
    if found:
        raise BadInput(
            f"{name} has {len(found)} clocks, {found}, and it is not certain which stamps the readings. python -m oio.inspect {name} compares "
            f"them. Type recording.time='\"{found[0]}\"'."
        )
    raise BadInput(
        f"{name} has no column that is named as a time; its columns are {list(layout.names)}. Type recording.time=NAME, or, for rows "
        f"without time stamps, recording.time_unit=row recording.period_s=1."
    )


def the_gas(name: str, layout: Layout) -> tuple[str, ...]:
    """Return the one or two columns that are named as a gas. Raises BadInput if there are more, or none."""
    found = tuple(column for column in layout.names if role_of(column) == "gas")
    if 1 <= len(found) <= 2:
        return found
    said = f"{len(found)} columns that are named as a gas, {list(found)}" if found else "no column that is named as a gas"
    raise BadInput(
        f"{name} has {said}, and it is not certain which are the elements; its columns are {list(layout.names)}. "
        f"Type recording.columns=[{(found or layout.names)[-1]}], one name per element of the sensor."
    )


def the_unit(mapping: TableMapping, columns: Sequence[str]) -> tuple[str, float]:
    """Return the unit of the readings and what 1 ppm is in it. Raises BadInput if the names do not say it, or it depends on the gas."""
    units = {unit for column in columns if (unit := unit_of(column)) in GAS_UNITS}
    unit = mapping.unit or (units.pop() if len(units) == 1 else None)
    if unit is None:
        raise BadInput(
            f"the unit of {list(columns)} is not certain: {'their names say ' + str(sorted(units)) if units else 'no name says it'}. "
            f"Type recording.unit=ppm, ppb, counts... (with recording.per_ppm=NUMBER for what 1 ppm is in it)."
        )
    per_ppm = mapping.per_ppm if mapping.per_ppm is not None else KNOWN_PER_PPM.get(unit)
    if per_ppm is None and unit in ("ug/m3", "mg/m3"):
        raise BadInput(
            f"{unit} become ppm by the molar mass of the gas, which is not in the file. Type recording.per_ppm=NUMBER: at 20 degC and "
            f"1013 hPa 1 ppm is M/24.06 mg/m3, e.g. 1913 ug/m3 of NO2 or 1164 ug/m3 of CO."
        )
    return unit, 1.0 if per_ppm is None else per_ppm


def climate(layout: Layout) -> tuple[str, ...]:
    """Return the columns of temperature [degC] and relative humidity [%] if there is just one of each, else none."""
    warm = [column for column in layout.names if role_of(column) == "temperature" and unit_of(column) in (None, "degC")]
    humid = [column for column in layout.names if role_of(column) == "humidity"]
    return (warm[0], humid[0]) if len(warm) == len(humid) == 1 else ()


def codes(values: Array) -> dict[float, int]:
    """Return the values of a column (k,) that look like codes for no measurement, each with how often it occurs."""
    finite = values[np.isfinite(values)]
    others = finite[~np.isin(finite, CODES)]
    if not len(others):
        return {}
    reach = FAR * max(float(np.ptp(others)), 1.0)
    near = [(code, int(np.count_nonzero(finite == code))) for code in CODES]
    return {code: count for code, count in near if count and (code < others.min() - reach or code > others.max() + reach)}


def _refuse_codes(columns: Sequence[str], cells: Cells) -> None:
    for i, column in enumerate(columns, start=1):
        found = codes(cells.values[:, i])
        if found:
            code, count = next(iter(found.items()))
            raise BadInput(
                f"'{column}' is {code:g} in {count} rows, far from its other values, which is how devices say that they have none; it is not "
                f"certain. Type recording.no_value=[[{code:g},{code:g}]] to drop and count them, or recording.no_value=[] to keep them."
            )
