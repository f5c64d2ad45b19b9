"""The table in the terminal, 80 columns wide, with its sentences below; and the file with the numbers."""

import csv
import json
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path

from rich.markup import escape
from rich.table import Table

from oio.cli import terminal
from oio.core.errors import BadInput
from oio.identify.record import Record
from oio.identify.row import Row

WIDTH = 80
SCHEMA = "oio.identify/1"


def show(record: Record, rows: Sequence[Row]) -> None:
    """Print the rows, then each sentence once with the elements that it holds for."""
    console = terminal.console(width=WIDTH)
    console.print(record.about, markup=False, highlight=False)
    table = Table(header_style="bold")
    for head in ("element", "quantity", "value", "95 % interval", "unit"):
        table.add_column(head, justify="right" if head in ("value", "95 % interval") else "left", overflow="fold")
    before = ""
    for row in rows:
        cells = (row.element if row.element != before else "", row.quantity, _number(row.value), _interval(row), row.unit)
        table.add_row(*map(escape, cells))
        before = row.element
    console.print(table)
    for note, whose in _notes(rows).items():
        console.print(f"- {', '.join(whose)}: {note}", markup=False, highlight=False)
    console.print(record.caution, markup=False, highlight=False)


def save(record: Record, rows: Sequence[Row], path: Path) -> None:
    """Write the rows at full precision. Raises BadInput for another ending, a file that is there already, or a folder that is not."""
    if path.suffix not in (".csv", ".json"):
        raise BadInput(f"--out {path} was given, but it ends in .csv or .json. Type e.g. --out {path.with_suffix('.csv')}.")
    if path.exists():
        raise BadInput(f"{path} is there already, and results are never overwritten. Give another name.")
    if not path.parent.is_dir():
        raise BadInput(f"--out {path} was given, but there is no folder {path.parent}. Make it first: mkdir -p {path.parent}")
    plain = [asdict(row) for row in rows]
    with path.open("x", encoding="utf-8", newline="") as file:
        if path.suffix == ".json":
            json.dump({"schema": SCHEMA, "about": record.about, "caution": record.caution, "rows": plain}, file, indent=2, allow_nan=False)
            file.write("\n")
        else:
            writer = csv.DictWriter(file, [field.name for field in fields(Row)], lineterminator="\n")
            writer.writeheader()
            writer.writerows(plain)


def _notes(rows: Sequence[Row]) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for row in rows:
        if row.note:
            found.setdefault(row.note, []).append(f"{row.element} {row.quantity}")
    return found


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


def _interval(row: Row) -> str:
    if row.low is None or row.high is None:
        return ""
    return f"< {row.high:.3g}" if row.value is None else f"{row.low:.3g} to {row.high:.3g}"
