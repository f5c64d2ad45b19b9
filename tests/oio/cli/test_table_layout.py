"""A table is never cut: whatever the width of the terminal, every head and every cell stands whole within it."""

import io

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len
from rich.console import Console

from oio.cli.table_layout import print_table

HEADS = ("case", "source error [mm]", "in 95 %", "NIS", "declared\n[%], after")
ROWS = [["cold start, open", "15.9", "no", "1.71", "87, 102 s / 109"], ["calibrated", "5.5", "yes", "", "100, 60 s / 69"]]


def printed(width, heads=HEADS, rows=ROWS, names=1):
    told = io.StringIO()
    print_table(Console(file=told, width=width, color_system=None), "a title", heads, rows, names)
    return told.getvalue()


def test_wide_terminals_get_rules_and_narrow_ones_shorter_heads():
    assert "┃ source error [mm] ┃ in 95 % ┃" in printed(200)
    assert "source error [mm]  in 95 %" in printed(68) and "┃" not in printed(68)
    assert "┃ source error [mm]" not in printed(62) and "[mm] ┃ 95 % ┃" in printed(62)
    assert "case               [mm] 95 %  NIS" in printed(52)


def test_columns_that_do_not_fit_beside_each_other_come_in_bands_that_repeat_the_names():
    told = printed(35)
    assert told.count("cold start, open") == told.count("calibrated") > 1


def test_a_terminal_too_narrow_for_any_column_gets_a_block_per_row_of_what_there_is_to_say():
    told = printed(28, ("case", "a head"), [["a name of twenty-two", "a cell too wide"], ["another", ""]])
    assert [line.rstrip() for line in told.splitlines()] == ["a title", "a name of twenty-two", "  a head  a cell too wide", "another"]


cells = st.text("ab 19.%[]", max_size=9).map(lambda text: " ".join(text.split()))


@given(st.integers(20, 200), st.lists(st.lists(cells, min_size=4, max_size=4), min_size=1, max_size=4), st.integers(1, 2))
def test_nothing_is_cut_and_nothing_is_wider_than_the_terminal(width, rows, names):
    told = printed(width, HEADS[:4], rows, names)
    assert max(map(cell_len, told.splitlines())) <= width and "…" not in told
    shown = " ".join(told.split())
    for row in rows:
        for cell in row[names:]:
            assert cell in shown or set(cell.split()) <= set(shown.replace("│", " ").split()), (cell, told)


@pytest.mark.parametrize("width", [60, 80, 200])
def test_markup_in_a_cell_is_shown_as_it_is(width):
    assert "[bold]x" in printed(width, ("job", "why"), [["[bold]x", "[/red]"]])
