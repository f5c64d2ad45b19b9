"""Rows of a table in the terminal."""

import sys
from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from oio.sweep.sheet import columns, text


def show_rows(rows: Sequence[Mapping[str, Any]], title: str) -> None:
    """Print rows, three significant digits each; `X_low` and `X_high` are shown as an interval beside X."""
    shown = Table(title=escape(title), title_justify="left")
    heads = [head for head in columns(rows) if not head.endswith(("_low", "_high"))]
    for head in heads:
        shown.add_column(escape(head))
    for row in rows:
        shown.add_row(*(escape(_cell(row, head)) for head in heads))
    Console(width=None if sys.stdout.isatty() else 200).print(shown)


def _cell(row: Mapping[str, Any], head: str) -> str:
    value = text(row.get(head), 3)
    between = [text(row.get(f"{head}{end}"), 3) for end in ("_low", "_high")]
    return f"{value} [{between[0]}, {between[1]}]" if all(between) and value else value
