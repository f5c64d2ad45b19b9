"""The table of a sweep in the terminal: a row per job, and one per group."""

import sys
from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from oio.cli.console import number
from oio.sweep.group_table import group_table
from oio.sweep.manifest import Outcome
from oio.sweep.records import error_of, records
from oio.sweep.row_display import show_rows

COLUMNS = (
    "job",
    "sensor",
    "dof",
    "air",
    "seed",
    "state",
    "cold [mm]",
    "calibrated [mm]",
    "in 95 %",
    "cal. time [s]",
    "u_a [ppm]",
    "wall [s]",
)
ROWS = 60  # of jobs in the terminal
TEXT = ("job", "sensor", "air", "state")  # left-justified


def show_sweep(outcomes: Sequence[Outcome], where: str) -> None:
    """Print the table of a sweep."""
    table = Table(title=escape(f"{len(outcomes)} jobs, {where}"), title_justify="left")
    for head in COLUMNS:
        table.add_column(escape(head), justify="left" if head in TEXT else "right")
    for outcome in outcomes[:ROWS]:
        table.add_row(*_cells(outcome))
    console = Console(width=None if sys.stdout.isatty() else 160)
    console.print(table)
    if len(outcomes) > ROWS:
        console.print(f"and {len(outcomes) - ROWS} jobs more: python -m oio.sweep table {where} --by job", markup=False, soft_wrap=True)
    rows = [row for row in records(outcomes) if error_of(row) is not None]
    groups = [group for group in group_table(rows, None) if group["jobs"] > 1] if rows else []
    if groups:
        show_rows(groups, "groups of several jobs; [low, high] are 95 % bootstrap intervals")
    for outcome in outcomes:
        if outcome.error:
            console.print(f"job {outcome.job.folder}: {outcome.error}", markup=False, soft_wrap=True)


def _cells(outcome: Outcome) -> list[str]:
    s, name = outcome.summary, escape(outcome.job.folder)
    if s is None:
        return [name, *[""] * 4, outcome.state, *[""] * 6]
    cold, calibrated = (_missed(s[key]) for key in ("cold", "calibrated"))
    inside = {True: "yes", False: "no", None: "-"}[s["calibrated"]["inside_95"] if s["calibrated"] else None]
    calibration = s["calibration"] or {"time_s": None, "u_a_ppm": None}
    return [
        name, s["sensor"], str(s["dof"]), s["air"], str(s["seed"]), outcome.state, cold, calibrated, inside,
        number(calibration["time_s"], 1.0, 0), number(calibration["u_a_ppm"], 1.0, 2), number(s["wall_s"], 1.0),
    ]  # fmt: skip


def _missed(outcome: Mapping[str, Any] | None) -> str:
    if outcome is None:
        return "-"
    if outcome.get("bearing_error_deg") is not None:
        return f"{outcome['bearing_error_deg']:.1f} deg"
    return number(outcome["source_error_m"])
