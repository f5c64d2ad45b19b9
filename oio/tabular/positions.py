"""Where the nose was while a table was written: columns of its place, or of the joints that carried it."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.tabular.file import file_bytes
from oio.tabular.mapping import ANGLES, LENGTHS, TableMapping
from oio.tabular.names import unit_of
from oio.tabular.read import Read, read_mapped


@dataclass(frozen=True, eq=False)
class Moving:
    """A log of a nose that moves: its readings (`Read`, at `gas_s` (k,)), and its positions (j, n) in m and rad at t_s (j,), or None.

    Both times count from the earlier beginning [s].
    """

    gas: Read
    gas_s: Array
    t_s: Array | None
    positions: Array | None
    notes: tuple[str, ...]


def read_moving(path: Path, mapping: TableMapping) -> Moving:
    """Read readings and positions of a file, which need not be in the same rows of it (of an MCAP log: in the same topic).

    Raises BadInput for what is no table, for columns that are not there, for a unit that is not certain.
    """
    gas = read_mapped(file_bytes(path, mapping.first_column), mapping, path.name)
    columns = mapping.nose_columns or mapping.joint_columns
    if not columns:
        return Moving(gas, gas.table.t_s, None, None, gas.notes)
    scales = [_scale(column, mapping) for column in columns]
    known = dataclasses.replace(
        gas.mapping, columns=tuple(columns), column_prefix="", unit="position", per_ppm=1.0, saturated=None, no_value=(), climate_columns=()
    )
    read = read_mapped(file_bytes(path, columns[0]), known, path.name)
    began_s = min(gas.table.start_s, read.table.start_s)
    dropped = sum(read.table.dropped.values())
    notes = (*gas.notes, f"{dropped} rows of positions were dropped: {dict(read.table.dropped)}") if dropped else gas.notes
    return Moving(
        gas, gas.table.start_s - began_s + gas.table.t_s, read.table.start_s - began_s + read.table.t_s, read.table.values * scales, notes
    )


def _scale(column: str, mapping: TableMapping) -> float:
    """What one unit of a column is in m or rad."""
    allowed = LENGTHS if mapping.nose_columns else LENGTHS | ANGLES
    unit = mapping.position_unit or unit_of(column)
    if unit not in allowed:
        said = f"no name says it ('{column}')" if unit is None else f"it is '{unit}' of '{column}'"
        raise BadInput(f"the unit of the positions is not certain: {said}. Type position_unit={', '.join(allowed)}.")
    return float(np.float64(allowed[unit]))
