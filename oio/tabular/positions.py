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
FASTER, SLOWEST_M_S = 3.0, 0.1  # than a nose moves: of a jump to 0, 0, 0, where nothing was known of it
LOST = "where the nose would have jumped, so its place was not known"
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
    key = "nose_columns" if mapping.nose_columns else "joint_columns"
    try:
        read = read_mapped(file_bytes(here, columns[0]), known, here.name)
    except BadInput as error:  # here they are no readings
        raise BadInput(str(error).replace("recording.columns", key)) from None
    scales = [_scale(column, mapping) for column in columns]
    _refuse_apart(path, gas.table, here, read.table)
    began_s = min(gas.table.start_s, read.table.start_s)
    gas_s, t_s = gas.table.start_s - began_s + gas.table.t_s, read.table.start_s - began_s + read.table.t_s
    positions, notes = read.table.values * scales, gas.notes
    if dropped := sum(read.table.dropped.values()):
        notes = (*notes, f"{dropped} rows of positions were dropped: {dict(read.table.dropped)}")
    if mapping.nose_columns and np.any(lost := lost_places(t_s, positions)):
        t_s, positions = t_s[~lost], positions[~lost]
        notes = (*notes, f"{np.count_nonzero(lost)} rows of positions are 0, 0, 0, {LOST}: they were left out")
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


def lost_places(t_s: Array, p_m: Array) -> NDArray[np.bool_]:
    """Which places of a nose (j, 3) at t_s (j,) are exactly 0, 0, 0 because nothing was known: it would have jumped there, or from there,
    FASTER times as fast as it ever moves between other places. One that is homed at the origin goes there as fast as elsewhere."""
    zero = np.all(p_m == 0.0, axis=1)
    lost = np.zeros(len(t_s), dtype=np.bool_)
    speed = np.linalg.norm(np.diff(p_m, axis=0), axis=1) / np.maximum(np.diff(t_s), 1e-9)
    elsewhere = ~zero[1:] & ~zero[:-1]
    if not np.any(zero) or not np.any(elsewhere):
        return lost
    limit = max(FASTER * float(np.quantile(speed[elsewhere], 0.99)), SLOWEST_M_S)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], zero, [False]]).astype(np.int8)))
    for begin, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        into, out = speed[begin - 1] if begin else 0.0, speed[end - 1] if end < len(t_s) else 0.0
        lost[begin:end] = max(into, out) > limit
    return lost


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
