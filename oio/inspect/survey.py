"""Survey of a table: everything counted, and the mapping as far as it is certain."""

import contextlib
import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.inspect.clocks import Clock, Comparison, clock_of, compare
from oio.inspect.columns import Column, column_of
from oio.tabular.clock import disorder, newest_first
from oio.tabular.devices import only_of, refuse_devices
from oio.tabular.guess import climate, the_gas, the_time, the_unit
from oio.tabular.layout import BOTH, Layout, find_layout
from oio.tabular.mapping import TableMapping
from oio.tabular.names import role_of, unit_of
from oio.tabular.read import refuse_marks
from oio.tabular.rows import read_cells, sample, with_numbers, without_numbers
from oio.tabular.stamps import find_unit, stamp
from oio.tabular.table_text import as_table
from oio.tabular.text import Text, decode


@dataclass(frozen=True, eq=False)
class Survey:
    """What was found. `open_keys` tells for each key that is not certain why, and what to type."""

    source: Text
    layout: Layout
    rows: int
    other: Mapping[str, int]  # what is no row, by reason
    clocks: tuple[Clock, ...]
    compared: tuple[Comparison, ...]  # each clock against the first
    columns: tuple[Column, ...]
    mapping: TableMapping
    open_keys: Mapping[str, str]


def survey(data: bytes, given: TableMapping, name: str) -> Survey:
    """Survey a file's bytes; raises BadInput for what is no table."""
    source = as_table(decode(data, given.encoding, name), given.delimiter)
    layout = find_layout(source, given.delimiter, given.decimal, given.time)
    clocks, stamps = _clocks(source, layout, given)
    timed = {name for column in stamps for name in (column, *column.split(BOTH))}
    names = [column for column in layout.names if column not in timed]
    only = only_of(given.where)
    cells = read_cells(source, layout, None, float, names, only)
    columns = tuple(column_of(column, cells.values[:, i]) for i, column in enumerate(names, start=1))
    known = [(clock.name, stamps[clock.name]) for clock in clocks if clock.notation and clock.last > clock.first]
    compared = tuple(found for other in known[1:] if (found := compare(known[0], other)) is not None)
    mapping, open_keys = _mapping(source, layout, given, clocks, columns)
    stamped = stamps.get(mapping.time or "")
    if several := _devices(source, layout, mapping):
        open_keys = {key: why for key, why in open_keys.items() if key != "session"} | {"where": several}
    elif stamped is not None and not newest_first(stamped) and (why := disorder(stamped)):
        open_keys = {key: why for key, why in open_keys.items() if key != "session"} | {"time": f"of '{mapping.time}' {why}"}
        mapping = dataclasses.replace(mapping, time=None, session=None)
    if given.decimal is None:
        try:
            used = [column for column in mapping.columns or () if column in names]
            refuse_marks(source, layout, mapping, used, cells.values[:, [1 + names.index(column) for column in used]])
        except BadInput as error:
            mapping, open_keys = dataclasses.replace(mapping, decimal=None), {**open_keys, "decimal": str(error)}
    return Survey(source, layout, len(cells.values), cells.other, clocks, compared, columns, mapping, open_keys)


def _devices(source: Text, layout: Layout, mapping: TableMapping) -> str:
    """Why one device is to be chosen; empty if there is one, or it was chosen."""
    try:
        if mapping.where is None:
            refuse_devices(source, layout, (*(mapping.time or "").split(BOTH), *(mapping.columns or ())))
    except BadInput as error:
        return str(error)
    return ""


def _clocks(source: Text, layout: Layout, given: TableMapping) -> tuple[tuple[Clock, ...], dict[str, Array]]:
    """Survey the columns that are named as a time or given as one."""
    clocks, stamps = [], {}
    named = [column for column in layout.names if role_of(column) == "time" and given.time_unit != "row"]
    with contextlib.suppress(BadInput):
        named = [the_time(source.name, layout)] if given.time is None and len(named) > 1 else named  # Date + Time are one
    for column in dict.fromkeys((*((given.time,) if given.time else ()), *named)):
        notation = _notation(source, layout, given, column)
        cells = read_cells(source, layout, column, stamp(notation or "s", layout.decimal), (), only_of(given.where))
        found = clock_of(column, notation, cells.values[:, 0])
        if found is not None:
            clocks.append(found)
            stamps[column] = cells.values[:, 0]
    return tuple(clocks), stamps


def _notation(source: Text, layout: Layout, given: TableMapping, column: str) -> str | None:
    if column == given.time and given.time_unit is not None:
        return given.time_unit
    try:
        return find_unit(column, unit_of(column), sample(source, layout, column), layout.decimal)[0]
    except BadInput:
        return None


def _mapping(
    source: Text, layout: Layout, given: TableMapping, clocks: tuple[Clock, ...], columns: tuple[Column, ...]
) -> tuple[TableMapping, dict[str, str]]:
    """Return the mapping as far as it is certain, and why the rest is not."""
    found: dict[str, object] = {"encoding": source.encoding, "delimiter": layout.delimiter, "decimal": layout.decimal}
    unsure: dict[str, str] = {}

    def settle(key: str, look: Callable[[], object]) -> None:
        if getattr(given, key) is not None:
            found[key] = getattr(given, key)
            return
        try:
            found[key] = look()
        except BadInput as error:
            unsure[key] = str(error)

    if given.time_unit != "row":
        settle("time", lambda: the_time(source.name, layout))
        time = found.get("time")
        if time is not None:
            settle("time_unit", lambda: find_unit(str(time), unit_of(str(time)), sample(source, layout, str(time)), layout.decimal)[0])
    numeric, unread = with_numbers(source, layout), without_numbers(source, layout)
    settle("columns", lambda: the_gas(source.name, numeric, unread))
    if "columns" in found:
        gas = given.columns or the_gas(source.name, numeric, unread)
        settle("unit", lambda: the_unit(given, gas)[0])
        if "unit" in found:
            settle("per_ppm", lambda: the_unit(given, gas)[1])
        _ask_codes(columns, gas, given, unsure)
    found["climate_columns"] = given.climate_columns if given.climate_columns is not None else climate(layout)
    used = next((clock for clock in clocks if clock.name == found.get("time")), None)
    if used is not None and len(used.sizes) > 1 and given.session is None and given.max_gap_s is None:
        unsure["session"] = (
            f"the clock was set back {len(used.sizes) - 1} times. Type recording.session={int(np.argmax(used.sizes)) + 1} for the longest."
        )
    return dataclasses.replace(given, **found), unsure  # type: ignore[arg-type]


def _ask_codes(columns: tuple[Column, ...], gas: tuple[str, ...], given: TableMapping, unsure: dict[str, str]) -> None:
    said = [f"{column.name}: {text}" for column in columns if column.name in gas for text in column.remarks if "no value" in text]
    if said and given.no_value is None:
        code = said[0].split(": ")[1].split(" ")[0]
        unsure["no_value"] = f"{'; '.join(said)}. Type recording.no_value=[[{code},{code}]], or recording.no_value=[] to keep them."
