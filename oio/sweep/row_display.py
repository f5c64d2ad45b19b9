"""Rows of a table in the terminal."""

from collections.abc import Mapping, Sequence
from typing import Any

from oio.cli import terminal
from oio.cli.table_layout import print_table
from oio.sweep.group_table import HEADS
from oio.sweep.sheet import columns, text


def show_rows(rows: Sequence[Mapping[str, Any]], title: str) -> None:
    """Print rows, three significant digits each; `X_low` and `X_high` are shown as an interval beside X."""
    heads = [head for head in columns(rows) if not head.endswith(("_low", "_high"))]
    names = next((i for i, head in enumerate(heads) if head in HEADS), 1)
    print_table(terminal.console(), title, heads, [[cell(row, head) for head in heads] for row in rows], names)


def cell(row: Mapping[str, Any], head: str) -> str:
    """Return one cell as text, with its interval if it has one."""
    value = text(row.get(head), 3)
    between = [text(row.get(f"{head}{end}"), 3) for end in ("_low", "_high")]
    return f"{value} [{between[0]}, {between[1]}]" if all(between) and value else value
