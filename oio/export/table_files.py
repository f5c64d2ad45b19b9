"""Tables as CSV and Parquet, as pandas and PlotJuggler read them."""

import csv
import importlib
from pathlib import Path

from oio.core.errors import BadInput
from oio.export.run_record import RunRecord
from oio.export.tables import tables


def write_csv(run: RunRecord, folder: Path) -> list[Path]:
    """Write tracks.csv, readings.csv and joints.csv; returns their paths.

    The first line names the columns: PlotJuggler reads no line before it, and takes a column whose first cell is empty for text, so that
    `nan` stands where there is no value.
    """
    made = tables(run)
    for name, table in made.items():
        with (folder / f"{name}.csv").open("x", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(table)
            writer.writerows(zip(*(column.tolist() for column in table.values()), strict=True))
    return [folder / f"{name}.csv" for name in made]


def write_parquet(run: RunRecord, folder: Path) -> list[Path]:
    """Write tracks.parquet, readings.parquet and joints.parquet, with the run in their metadata; returns their paths.

    Raises BadInput where the package pyarrow is not installed.
    """
    try:
        arrow, parquet = (importlib.import_module(name) for name in ("pyarrow", "pyarrow.parquet"))
    except ModuleNotFoundError:
        raise BadInput("Parquet needs the package pyarrow. Type: pip install pyarrow, or give --to csv.") from None
    made = tables(run)
    for name, table in made.items():
        parquet.write_table(arrow.table(dict(table)).replace_schema_metadata({"oio": run.title}), folder / f"{name}.parquet")
    return [folder / f"{name}.parquet" for name in made]
