"""A table read by a mapping: what is null in it is read off the file and said; what is not certain is refused with what to type."""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.tabular.clock import disorder, newest_first
from oio.tabular.devices import only_of, refuse_devices
from oio.tabular.guess import climate, codes, refuse_clock, the_gas, the_time, the_unit
from oio.tabular.layout import BOTH, Layout, find_layout
from oio.tabular.mapping import TableMapping
from oio.tabular.names import unit_of
from oio.tabular.rows import Cells, read_cells, sample, with_numbers, without_numbers
from oio.tabular.stamps import LONGER, PER_S, find_unit, stamp, wrap_s
from oio.tabular.table import Table, Wanted, read_table
from oio.tabular.table_text import as_table
from oio.tabular.text import Text, decode
from oio.tabular.thousands import refuse_open, refuse_thousands


@dataclass(frozen=True, eq=False)
class Read:
    """A table, the complete mapping by which it was read, and what of that was read off the file, as sentences."""

    table: Table
    mapping: TableMapping
    notes: tuple[str, ...]


def read_mapped(data: bytes, mapping: TableMapping, name: str) -> Read:
    """Read a file's bytes by a mapping. Raises BadInput for what is no table, and for what is null in the mapping and not certain."""
    source = as_table(decode(data, mapping.encoding, name), mapping.delimiter)
    numbered = mapping.time_unit == "row"
    layout = find_layout(source, mapping.delimiter, mapping.decimal, _in_header(mapping))
    full, notes = complete(mapping, source, layout)
    columns = tuple(full.column_prefix + column for column in full.columns or ())
    wanted = Wanted(
        None if numbered else full.time, _stamp(full), (*columns, *(full.climate_columns or ())), len(columns),
        np.inf if full.saturated is None else full.saturated, full.no_value or (), wrap_s(full.time_unit or ""),
        full.max_gap_s, full.session,
    )  # fmt: skip
    only = only_of(mapping.where)
    if only is None:
        refuse_devices(source, layout, (*(wanted.time or "").split(BOTH), *wanted.columns))
    cells = read_cells(source, layout, wanted.time, wanted.stamp, wanted.columns, only)
    if mapping.decimal is None:
        refuse_marks(source, layout, full, columns, cells.values[:, 1 : 1 + len(columns)])
    if mapping.no_value is None:
        _refuse_codes(columns, cells)
    if newest_first(cells.values[:, 0]):
        cells, notes = (
            dataclasses.replace(cells, values=cells.values[::-1]),
            (*notes, "rows: the newest is first, so they were turned round"),
        )
    if not numbered and (why := disorder(cells.values[:, 0])):
        raise BadInput(f"{name} has a time column '{full.time}', but {why}")
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
    if source.form:
        notes.append(f"lines: {source.form}")
    words = [f"{key} {value!r}" for key, value in found.items() if getattr(mapping, key) is None]
    if words:
        notes.append("layout: " + ", ".join(words))
    if mapping.time_unit != "row":
        found["time"] = mapping.time or the_time(source.name, layout)
        found["time_unit"], reason = _time_unit(mapping, source, layout, str(found["time"]))
        if mapping.time is None or mapping.time_unit is None:
            notes.append(f"time: '{found['time']}' in {found['time_unit']}{reason}")
    found["columns"] = mapping.columns or the_gas(source.name, with_numbers(source, layout), without_numbers(source, layout))
    refuse_clock(source.name, found.get("time"), found["columns"])  # type: ignore[arg-type]
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


def refuse_marks(source: Text, layout: Layout, mapping: TableMapping, columns: Sequence[str], values: Array) -> None:
    """Raise BadInput if time or `columns`, whose numbers are `values` (k, m), may have marks between thousands."""
    if mapping.time is not None and mapping.time_unit in (*PER_S, *LONGER):
        refuse_open(source, mapping.time, sample(source, layout, mapping.time), 0.0)
    refuse_thousands(source, layout, columns, values)


def _time_unit(mapping: TableMapping, source: Text, layout: Layout, time: str) -> tuple[str, str]:
    if mapping.time_unit is not None:
        return mapping.time_unit, ""
    unit, reason = find_unit(time, unit_of(time), sample(source, layout, time), layout.decimal)
    return unit, f": {reason}"


def _refuse_codes(columns: Sequence[str], cells: Cells) -> None:
    for i, column in enumerate(columns, start=1):
        found = codes(cells.values[:, i])
        if found:
            code, count = next(iter(found.items()))
            raise BadInput(
                f"'{column}' is {code:g} in {count} rows, far from its other values, which is how devices say that they have none; it is "
                f"not certain. Type recording.no_value=[[{code:g},{code:g}]] to drop and count them, or recording.no_value=[] to keep."
            )
