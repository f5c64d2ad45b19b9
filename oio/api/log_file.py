"""`read_log` and `LogFile`: a log of another program as arrays, by a mapping of its columns."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from oio.api.samples import JointPath, NosePath, Readings
from oio.core.errors import BadInput
from oio.core.records import Array
from oio.tabular.mapping import open_mapping
from oio.tabular.positions import read_moving


@dataclass(frozen=True, eq=False)
class LogFile:
    """What a log holds; times are seconds since it began.

    `path`: where the nose was, None if no columns of that were named. `climate`: temperature [degC] and relative humidity [%] (m, 2) at
    the rows `climate_s` (m,) of the readings, None if it has none. `notes`: what of the mapping was read off the file, as sentences.
    `dropped`: number of rows that are not used, by reason. `holes_s` (h, 2): begins and ends of what is missing of the path; it goes
    straight there, and the readings in it are left out.
    """

    readings: Readings
    path: NosePath | JointPath | None
    climate_s: Array
    climate: Array | None
    notes: tuple[str, ...]
    dropped: Mapping[str, int]
    holes_s: Array


def read_log(
    path: str | Path, sigma_ppm: npt.ArrayLike | None = None, positions: str | Path | None = None, **mapping: object
) -> LogFile:  # fmt: skip
    """Read a text table (CSV and its kind, .gz, Parquet) or an MCAP log of any program (JSON, Protobuf, ROS 2).

    `mapping`: keys of conf/recording/csv.yaml, e.g. columns=["/co2.data"], unit="ppm", nose_columns=["x", "y", "z"], position_unit="mm",
    or joint_columns of the unlocked joints, base first; `python -m oio.inspect FILE` writes most of them. What is not given is read off
    the file; the columns of positions never are. `positions`: another file that has them, stamped by the same clock.
    `sigma_ppm`: standard uncertainty of a reading; None: as the data sheet has it.
    Raises BadInput for a file that is no table, a column that is not there, and for what is not given and not certain.
    """
    file = Path(path)
    if not file.is_file():
        raise BadInput(f"{file} is no file. Give the path of a table (.csv, .txt, .csv.gz, .parquet) or an MCAP log.")
    lists = {key: tuple(value) if isinstance(value, list) else value for key, value in mapping.items()}
    beside = None if positions is None else Path(positions)
    if beside is not None and not beside.is_file():
        raise BadInput(f"{beside} is no file. Give the path of a table with the positions, or leave positions out.")
    read = read_moving(file, open_mapping(**lists), beside)
    table, elements = read.gas.table, len(read.gas.mapping.columns or ())
    if not np.any(read.kept):
        raise BadInput(
            f"{file} does not tell where the nose was at any of its readings. Give the columns of its positions, or another log."
        )
    values = table.values[read.kept]
    ppm = values[:, :elements] / (read.gas.mapping.per_ppm or 1.0)
    readings = Readings(
        np.repeat(read.gas_s, elements), ppm=ppm.ravel(), element=np.tile(np.arange(elements), len(ppm)), sigma_ppm=sigma_ppm
    )
    moved: NosePath | JointPath | None = None
    if read.t_s is not None and read.positions is not None:
        moved = (NosePath if read.gas.mapping.nose_columns else JointPath)(read.t_s, read.positions)
    climate = values[:, elements:]
    return LogFile(readings, moved, read.gas_s, climate if climate.size else None, read.notes, table.dropped, read.holes_s)
