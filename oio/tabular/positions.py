"""Where the nose was while a table was written: columns of its place, or of the joints that carried it."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.tabular.file import file_bytes
from oio.tabular.mapping import ANGLES, LENGTHS, TableMapping, open_mapping
from oio.tabular.names import unit_of
from oio.tabular.read import Read, read_mapped
from oio.tabular.table import Table

HOLE, HOLE_S = 10.0, 1.0  # positions are missing after so many usual steps, but not before so long [s],
ELSEWHERE = 0.005  # if any of them has changed by this, in m or rad


@dataclass(frozen=True, eq=False)
class Moving:
    """A log of a nose that moves: its readings (`Read`, at `gas_s` (k,)), and its positions (j, n) in m and rad at t_s (j,), or None.

    Both times count from the earlier beginning [s]. In a hole (h, 2) [s] of the positions nobody knows where the nose was: readings in it
    are left out of `gas_s`, and `kept` (m,) says which rows of the table are left.
    """

    gas: Read
    gas_s: Array
    kept: NDArray[np.bool_]
    holes_s: Array
    t_s: Array | None
    positions: Array | None
    notes: tuple[str, ...]


def read_moving(path: Path, mapping: TableMapping, positions_in: Path | None = None) -> Moving:
    """Read readings and positions of a file, which need not be in the same rows of it (of an MCAP log: in the same topic); `positions_in`:
    another file has the positions, by stamps of the same clock.

    Raises BadInput for what is no table, for columns that are not there, for a unit that is not certain.
    """
    gas = read_mapped(file_bytes(path, mapping.first_column), mapping, path.name)
    columns = mapping.nose_columns or mapping.joint_columns
    if positions_in is not None and not columns:
        raise BadInput(f"{positions_in} was given for positions, but not its columns. Give nose_columns=[X,Y,Z], or joint_columns=[...].")
    if not columns:
        return Moving(gas, gas.table.t_s, np.ones(len(gas.table.t_s), dtype=np.bool_), np.empty((0, 2)), None, None, gas.notes)
    here = path if positions_in is None else positions_in
    known = dataclasses.replace(
        gas.mapping if positions_in is None else open_mapping(),
        columns=tuple(columns), column_prefix="", unit="position", per_ppm=1.0, saturated=None, no_value=(), climate_columns=(),
    )  # fmt: skip
    read = read_mapped(file_bytes(here, columns[0]), known, here.name)
    scales = [_scale(column, mapping) for column in columns]
    _refuse_apart(path, gas.table, here, read.table)
    began_s = min(gas.table.start_s, read.table.start_s)
    gas_s, t_s = gas.table.start_s - began_s + gas.table.t_s, read.table.start_s - began_s + read.table.t_s
    positions, notes = read.table.values * scales, gas.notes
    if dropped := sum(read.table.dropped.values()):
        notes = (*notes, f"{dropped} rows of positions were dropped: {dict(read.table.dropped)}")
    holes_s = holes(t_s, positions)
    kept = outside(gas_s, holes_s)
    if len(holes_s):
        begin, end = holes_s[int(np.argmax(np.ptp(holes_s, axis=1)))]
        notes = (
            *notes,
            f"where the nose was is not told in {len(holes_s)} holes, the longest from {begin:g} to {end:g} s: {np.count_nonzero(~kept)} "
            f"rows of readings in them were left out",
        )
    return Moving(gas, gas_s[kept], kept, holes_s, t_s, positions, notes)


def _refuse_apart(path: Path, gas: Table, here: Path, positions: Table) -> None:
    """Refuse two clocks without a common time."""
    (begin, end), (first, last) = ((table.start_s, table.start_s + float(table.t_s[-1])) for table in (gas, positions))
    if first >= end or last <= begin:
        raise BadInput(
            f"the readings of {path.name} are stamped {begin:.6g} to {end:.6g} s, but the positions of {here.name} {first:.6g} to "
            f"{last:.6g} s: they have no time in common. Give files that were stamped by one clock, e.g. since 1970."
        )


def holes(t_s: Array, positions: Array) -> Array:
    """Begins and ends (h, 2) [s] of what is missing in positions (j, n) at t_s (j,): HOLE times the usual step and more, and the nose is
    elsewhere after it. A log that is written while the arm moves alone has gaps, after which it is where it was."""
    step = np.diff(t_s)
    if not len(step):
        return np.empty((0, 2))
    missing = step > max(HOLE * float(np.median(step)), HOLE_S)
    missing &= np.abs(np.diff(positions, axis=0)).max(axis=1) > ELSEWHERE
    return np.column_stack([t_s[:-1][missing], t_s[1:][missing]])


def outside(t_s: Array, holes_s: Array, after_s: float = 0.0) -> NDArray[np.bool_]:
    """Which of the times (m,) are in no hole (h, 2), nor in `after_s` after one."""
    inside = (t_s[:, None] > holes_s[:, 0]) & (t_s[:, None] < holes_s[:, 1] + after_s)
    return np.asarray(~inside.any(axis=1))


def _scale(column: str, mapping: TableMapping) -> float:
    """What one unit of a column is in m or rad."""
    allowed = LENGTHS if mapping.nose_columns else LENGTHS | ANGLES
    unit = mapping.position_unit or unit_of(column)
    if unit not in allowed:
        said = f"no name says it ('{column}')" if unit is None else f"it is '{unit}' of '{column}'"
        raise BadInput(f"the unit of the positions is not certain: {said}. Type position_unit={', '.join(allowed)}.")
    return float(np.float64(allowed[unit]))
