"""Tables as files: CSV and Parquet at full precision, Markdown and LaTeX for people."""

import csv
import importlib
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from oio.core.errors import BadInput

Rows = Sequence[Mapping[str, Any]]


def save(rows: Rows, path: Path) -> None:
    """Write rows to a file of the kind that its name ends in. Raises BadInput for another kind, and for a file that is there already."""
    if path.suffix not in WRITERS:
        raise BadInput(f"--out {path} was given, but a table ends in {', '.join(WRITERS)}. Type e.g. --out {path.with_suffix('.csv')}.")
    if path.exists():
        raise BadInput(f"{path} is there already, and results are never overwritten. Give another name.")
    if not path.parent.is_dir():
        raise BadInput(f"--out {path} was given, but there is no folder {path.parent}. Make it first: mkdir -p {path.parent}")
    WRITERS[path.suffix](rows, columns(rows), path)


def columns(rows: Rows) -> list[str]:
    """Return the columns of all rows, in the order in which they first come."""
    return list(dict.fromkeys(key for row in rows for key in row))


def text(value: object, digits: int = 4) -> str:
    """Return a cell for people: so many significant digits, nothing for what is missing."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def _csv(rows: Rows, heads: Sequence[str], path: Path) -> None:
    with path.open("x", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, heads, lineterminator="\n")
        writer.writeheader()
        writer.writerows({key: "" if isinstance(v, float) and math.isnan(v) else v for key, v in row.items()} for row in rows)


def _markdown(rows: Rows, heads: Sequence[str], path: Path) -> None:
    lines = [heads, ["---"] * len(heads), *([text(row.get(head)) for head in heads] for row in rows)]
    path.write_text("".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |\n" for line in lines), encoding="utf-8")


def _latex(rows: Rows, heads: Sequence[str], path: Path) -> None:
    body = "".join(f"{' & '.join(_escaped(text(row.get(head))) for head in heads)} \\\\\n" for row in rows)
    head = " & ".join(map(_escaped, heads))
    rules = f"\\begin{{tabular}}{{{'l' * len(heads)}}}\n\\hline\n{head} \\\\\n\\hline\n{body}\\hline\n\\end{{tabular}}\n"
    path.write_text(rules, encoding="utf-8")


def _escaped(cell: str) -> str:
    special = {"\\": "\\textbackslash{}", "~": "\\textasciitilde{}", "^": "\\textasciicircum{}", **{c: f"\\{c}" for c in "&%$#_{}"}}
    return "".join(special.get(c, c) for c in cell)


def _parquet(rows: Rows, heads: Sequence[str], path: Path) -> None:
    try:
        arrow, parquet = (importlib.import_module(name) for name in ("pyarrow", "pyarrow.parquet"))
    except ModuleNotFoundError:
        raise BadInput("Parquet needs the package pyarrow. Type: pip install pyarrow, or give a name that ends in .csv.") from None
    plain = [{head: _simple(row.get(head)) for head in heads} for row in rows]
    parquet.write_table(arrow.Table.from_pylist(plain), path)


def _simple(value: object) -> object:
    return value if value is None or isinstance(value, int | float | str) else str(value)


WRITERS: dict[str, Callable[[Rows, Sequence[str], Path], None]] = {".csv": _csv, ".parquet": _parquet, ".md": _markdown, ".tex": _latex}
