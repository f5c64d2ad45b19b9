"""Tables that fit the terminal: ruled or plain, with heads of one word a line, in bands of a few columns, or a block per row."""

import re
from collections.abc import Sequence

from rich import box
from rich.console import Console, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

Rows = Sequence[Sequence[str]]
ENDLESS = 100_000  # columns


def print_table(console: Console, title: str, heads: Sequence[str], rows: Rows, names: int = 1) -> None:
    """Print a table of plain text in the first layout that fits the console.

    The first `names` columns name the row: they are left-justified, and repeated in every band or head a block.
    """
    broken = ["\n".join(_words(head)) for head in heads]
    tables = (_ruled(heads, rows, names), _plain(heads, rows, names, 2), _ruled(broken, rows, names))
    fitting = next(([table] for table in tables if _fits(console, table)), None)
    console.print(Text(title, style="table.title"), soft_wrap=False)
    for part in fitting or _bands(console, broken, rows, names) or _blocks(heads, rows, names):
        console.print(part, soft_wrap=False)


def _fits(console: Console, table: Table) -> bool:
    endless = console.options.update(width=ENDLESS)  # a table is never measured wider than its options
    return console.measure(table, options=endless).maximum <= console.width


def _words(head: str) -> list[str]:
    """The words of a head; a number stays with its per cent sign."""
    return re.split(r"\s+(?!%)", head)


def _ruled(heads: Sequence[str], rows: Rows, names: int) -> Table:
    return _filled(Table(box=box.HEAVY_HEAD), heads, rows, names)


def _plain(heads: Sequence[str], rows: Rows, names: int, gap: int) -> Table:
    return _filled(Table(box=box.SIMPLE_HEAD, padding=(0, gap - 1, 0, 0), pad_edge=False, show_edge=False), heads, rows, names)


def _filled(table: Table, heads: Sequence[str], rows: Rows, names: int) -> Table:
    for number, head in enumerate(heads):
        table.add_column(Text(head), justify="left" if number < names else "right", vertical="top", no_wrap=True)
    for row in rows:
        table.add_row(*map(Text, row))
    return table


def _bands(console: Console, heads: Sequence[str], rows: Rows, names: int) -> list[RenderableType]:
    """Plain tables one below the other, each of as many columns as fit; none if a column does not fit beside the names."""
    bands, band = list[RenderableType](), list[int]()
    for column in range(names, len(heads)):
        wider = _of(heads, rows, names, [*band, column])
        if _fits(console, wider):
            band.append(column)
        elif band and _fits(console, _of(heads, rows, names, [column])):
            bands, band = [*bands, _of(heads, rows, names, band), Text()], [column]
        else:
            return []
    return [*bands, _of(heads, rows, names, band)]


def _of(heads: Sequence[str], rows: Rows, names: int, columns: Sequence[int]) -> Table:
    chosen = [*range(names), *columns]
    return _plain([heads[i] for i in chosen], [[row[i] for i in chosen] for row in rows], names, 1)


def _blocks(heads: Sequence[str], rows: Rows, names: int) -> list[RenderableType]:
    """A block per row: its name, then a line per column that has something to say."""
    parts = list[RenderableType]()
    for row in rows:
        block = Table.grid(padding=(0, 2, 0, 0))
        for head, cell in zip(heads[names:], row[names:], strict=True):
            if cell:
                block.add_row(Text(" ".join(head.split())), Text(cell, overflow="fold"))
        parts.append(Text(" ".join(filter(None, row[:names])), style="bold"))
        parts += [Padding(block, (0, 0, 0, 2))] if block.row_count else []
    return parts
