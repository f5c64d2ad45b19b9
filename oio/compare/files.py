"""Comparison as a file: CSV and JSON at full precision, Markdown for people."""

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from oio.compare.comparison import Comparison, Row
from oio.compare.display import letters
from oio.compare.verdict import verdict
from oio.core.errors import BadInput

SCHEMA = "oio.compare/1"


def refuse_unwritable(path: Path) -> None:
    """Raise BadInput for a file of another kind, one that is there already, or one in no folder."""
    if path.suffix not in WRITERS:
        raise BadInput(f"--out {path} was given, but it ends in {', '.join(WRITERS)}. Type e.g. --out {path.with_suffix('.csv')}")
    if path.exists():
        raise BadInput(f"{path} is there already, and results are never overwritten. Give another name.")
    if not path.parent.is_dir():
        raise BadInput(f"--out {path} was given, but there is no folder {path.parent}. Make it first: mkdir -p {path.parent}")


def save(found: Comparison, path: Path) -> None:
    """Write the comparison to a file of the kind that its name ends in; errors as `refuse_unwritable`."""
    refuse_unwritable(path)
    WRITERS[path.suffix](found, path)


def _row(found: Comparison, row: Row) -> dict[str, Any]:
    values = {f"value_{x}": value for x, value in zip(letters(found), row.values, strict=True)}
    uncertainties = {f"u_{x}": u for x, u in zip(letters(found), row.u, strict=True)}
    several = len(found.names) > 2
    size = {"trend_sd": row.sd} if several else {"difference": row.values[1] - row.values[0], "difference_sd": row.sd}
    tested = {"chi2": row.size**2, "p": None if row.test is None else row.test.p, "counted": row.counted, "flagged": row.flagged}
    return {"quantity": row.key, "unit": row.unit, **values, **uncertainties, **size, **tested}


def _csv(found: Comparison, path: Path) -> None:
    rows = [_row(found, row) for row in found.rows]
    with path.open("x", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def _json(found: Comparison, path: Path) -> None:
    document = {
        "schema": SCHEMA,
        "calibrations": dict(zip(letters(found), found.names, strict=True)),
        "judged": found.judged,
        "agree": found.agree,
        "verdict": verdict(found),
        "chi2": found.chi2,
        "degrees_of_freedom": found.dof,
        "p": found.p,
        "facts": [*found.facts, *found.remarks],
        "quantities": [_row(found, row) for row in found.rows],
    }
    path.write_text(json.dumps(document, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def _markdown(found: Comparison, path: Path) -> None:
    rows = [_row(found, row) for row in found.rows]
    lines = [list(rows[0]), ["---"] * len(rows[0]), *([_cell(value) for value in row.values()] for row in rows)]
    table = "".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |\n" for line in lines)
    names = "".join(f"- {letter}: {name}\n" for letter, name in zip(letters(found), found.names, strict=True))
    path.write_text(f"{names}\n{table}\n{verdict(found)}\n", encoding="utf-8")


def _cell(value: object) -> str:
    return "" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)


WRITERS: dict[str, Callable[[Comparison, Path], None]] = {".csv": _csv, ".json": _json, ".md": _markdown}
