"""Comparison as a table for people, 80 columns wide for two calibrations or three."""

import sys

from rich.table import Table

from oio.cli import terminal
from oio.compare.comparison import Comparison, Row
from oio.compare.verdict import verdict

WIDTH, VALUE_WIDTH = 80, 11
LEGEND = "* as rare as 3 sd. (In brackets: it follows from the others, or is the likeliest of a list, and decides nothing.)"


def show(found: Comparison, by_section: bool) -> None:
    """Print the table, the largest difference that may decide first or in the order of the file, then chi-square and verdict."""
    several = len(found.names) > 2
    console = terminal.console(width=WIDTH + VALUE_WIDTH * max(len(found.names) - 3, 0), highlight=False, markup=False, file=sys.stdout)
    for letter, name in zip(letters(found), found.names, strict=True):
        console.print(f"{letter}: {name}", soft_wrap=True)
    console.print(_table(found, by_section, several))
    console.print(LEGEND)
    for remark in (*found.facts, *found.remarks):
        console.print(f"{remark}.")
    console.print(f"chi-square {found.chi2:.1f} of {found.dof} ({', '.join(found.judged)}), p {probability(found.p)}")
    console.print(verdict(found))


def letters(found: Comparison) -> list[str]:
    """Return a short name for each calibration: A, B, C ..., then numbers."""
    return [chr(ord("A") + i) if i < 26 else str(i + 1) for i in range(len(found.names))]


def _table(found: Comparison, by_section: bool, several: bool) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("quantity", overflow="fold")
    table.add_column("unit", no_wrap=True)
    for head in (*letters(found), *(["trend"] if several else ["B - A", "sd"]), "p"):
        table.add_column(head, justify="right", no_wrap=True)
    section = ""
    for row in found.rows if by_section else sorted(found.rows, key=lambda row: (not row.counted, -row.size)):
        if by_section and row.key.split(".")[0] != section:
            section = row.key.split(".")[0]
            table.add_row(section)
        table.add_row(*_cells(row, several))
    return table


def _cells(row: Row, several: bool) -> list[str]:
    size = f"{row.sd:.1f}{'*' if row.flagged else ''}"
    mark = size if row.counted else f"({size})"
    values = [_short(value) for value in row.values]
    difference = [] if several else [f"{row.values[-1] - row.values[0]:.3g}"]
    p = None if row.test is None else row.test.p
    return [row.key.split(".", 1)[1], row.unit, *values, *difference, mark, "" if p is None else probability(p)]


def _short(value: float) -> str:
    """Return a value with four digits, or three where it would be wider than nine characters."""
    return f"{value:.4g}" if len(f"{value:.4g}") <= 9 else f"{value:.3g}"


def probability(p: float) -> str:
    """Return a probability in at most six characters."""
    return "<1e-4" if p < 1e-4 else f"{p:.2g}"
