"""The survey of a table as text, 80 columns wide."""

import math
import textwrap

from rich.console import Console
from rich.table import Table as Grid

from oio.cli import terminal
from oio.inspect.clocks import Clock
from oio.inspect.survey import Survey
from oio.tabular.layout import WORDS

WIDTH = 80
INDENT = " " * 11


def show(found: Survey) -> None:
    """Print layout, rows, clocks, columns and what is not certain."""
    console = terminal.console(width=WIDTH, highlight=False, markup=False)
    for head, text in [*_layout(found), *(("clock", _clock(clock)) for clock in found.clocks), *_rest(found)]:
        _print(console, head, text)
    console.print(_columns(found))
    for column in found.columns:
        missing = (f"{column.others} rows without a number",) if column.others and column.numbers else ()
        if missing or column.remarks:
            _print(console, "remark", f"'{column.name}': " + "; ".join((*missing, *column.remarks)))
    for key, reason in found.open_keys.items():
        _print(console, "uncertain", f"{key}: {reason}")


def _print(console: Console, head: str, text: str) -> None:
    lines = textwrap.wrap(printable(text), WIDTH - len(INDENT), break_on_hyphens=False)
    for i, line in enumerate(lines):
        console.print(f"{head if i == 0 else '':<{len(INDENT)}}{line}", soft_wrap=True)


def printable(text: str) -> str:
    """Return a text of a file's without what a terminal would obey."""
    return "".join(character if character.isprintable() else "?" for character in text)


def _layout(found: Survey) -> list[tuple[str, str]]:
    layout, total = found.layout, found.rows + sum(found.other.values())
    delimiter = WORDS.get(layout.delimiter, f"'{layout.delimiter}'")
    mark = "comma" if layout.decimal == "," else "point"
    header = "no header" if not layout.header else f"header behind {layout.preamble} other lines" if layout.preamble else "header in line 1"
    form = f"{found.source.form}, " if found.source.form else ""
    others = ", ".join(f"{count} {reason}" for reason, count in found.other.items())
    return [
        ("file", f"{found.source.name}, {len(found.source.text)} characters"),
        ("text", f"{form}{found.source.encoding}, lines end in {found.source.line_ends}, delimiter {delimiter}, decimal {mark}, {header}"),
        ("rows", f"{total}, of {len(layout.names)} cells" + (f"; {others}" if others else "; none is short, long or repeated")),
    ]


def _clock(clock: Clock) -> str:
    unit = clock.unit
    every = f"every {clock.step:.4g} {unit} (median), jitter {clock.jitter:.3g} {unit}" if math.isfinite(clock.step) else "all the same"
    said = [
        f"'{clock.name}' ({clock.notation or 'unit not certain'}): {clock.stamps} stamps over {clock.last - clock.first:.6g} {unit}, "
        f"{every}"
    ]
    if clock.gaps:
        said.append(f"{clock.gaps} gaps of more than 3 steps, the longest {clock.longest:.4g} {unit} at {clock.longest_at:.6g} {unit}")
    if clock.newest_first:
        said.append("the newest row is first, so they are turned round")
    counted = (
        (clock.missing, "rows without a time"),
        (clock.duplicates, "repeat the stamp before"),
        (clock.out_of_order, "out of order"),
        (len(clock.sizes) - 1, f"times set back (sessions of {', '.join(map(str, clock.sizes[:8]))} rows)"),
        (clock.overflows, "overflows, carried on"),
    )
    return "; ".join([*said, *(f"{count} {text}" for count, text in counted if count)])


def _rest(found: Survey) -> list[tuple[str, str]]:
    if not found.clocks:
        return [] if "time_unit" in found.open_keys else [("clock", "no column is named as a time")]
    return [
        (
            "clocks",
            f"'{one.names[1]}' runs {one.rate_ppm:+.4g} ppm against '{one.names[0]}', deviating from that by up to {one.scatter_s:.3g} s",
        )
        for one in found.compared
    ]


def _columns(found: Survey) -> Grid:
    grid = Grid(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    grid.add_column("column", overflow="fold", max_width=34)
    grid.add_column("holds", no_wrap=True)
    for head in ("numbers", "low", "median", "high"):
        grid.add_column(head, justify="right", no_wrap=True)
    for column in found.columns:
        held = " ".join(word for word in (column.role, column.unit) if word) or "?"
        values = (f"{value:.5g}" if column.numbers else "" for value in (column.low, column.middle, column.high))
        grid.add_row(printable(column.name), held, str(column.numbers), *values)
    return grid
