"""The table of a sweep in the terminal: a row per job, and one per group."""

from collections.abc import Mapping, Sequence
from typing import Any

from oio.cli import terminal
from oio.cli.console import number
from oio.cli.table_layout import print_table
from oio.sweep.group_table import group_table
from oio.sweep.manifest import Outcome
from oio.sweep.records import error_of, records
from oio.sweep.row_display import show_rows

HEADS = (
    "job", "sensor", "air", "state", "dof", "seed", "cold [mm]", "calibrated [mm]", "in 95 %", "cal. time [s]", "u_a [ppm]", "wall [s]",
)  # fmt: skip
NAMES = 4  # of them, left-justified
ROWS = 60  # of jobs in the terminal


def show_sweep(outcomes: Sequence[Outcome], where: str) -> None:
    """Print the table of a sweep."""
    print_table(terminal.console(), f"{len(outcomes)} jobs, {where}", HEADS, [_cells(outcome) for outcome in outcomes[:ROWS]], NAMES)
    console = terminal.console(soft_wrap=True)
    if len(outcomes) > ROWS:
        console.print(f"and {len(outcomes) - ROWS} jobs more: python -m oio.sweep table {where} --by job", markup=False)
    rows = [row for row in records(outcomes) if error_of(row) is not None]
    groups = [group for group in group_table(rows, None) if group["jobs"] > 1] if rows else []
    if groups:
        show_rows(groups, "groups of several jobs; [low, high] are 95 % bootstrap intervals")
    for outcome in outcomes:
        if outcome.error:
            console.print(f"job {outcome.job.folder}: {outcome.error}", markup=False)


def _cells(outcome: Outcome) -> list[str]:
    s, name = outcome.summary, outcome.job.folder
    if s is None:
        return [name, "", "", outcome.state, *[""] * 8]
    cold, calibrated = (_missed(s[key]) for key in ("cold", "calibrated"))
    inside = _yes_or_share(s["calibrated"]["inside_95"] if s["calibrated"] else None)
    calibration = s["calibration"] or {"time_s": None, "u_a_ppm": None}
    return [
        name, s["sensor"], s["air"], outcome.state, str(s["dof"]), _seeds(s), cold, calibrated, inside,
        number(calibration["time_s"], 1.0, 0), number(calibration["u_a_ppm"], 1.0, 2), number(s["wall_s"], 1.0),
    ]  # fmt: skip


def _seeds(summary: Mapping[str, Any]) -> str:
    """The seed of a run, or the first and the last of several trials."""
    trials = summary.get("distribution", {}).get("trials", 1)
    return str(summary["seed"]) if trials == 1 else f"{summary['seed']} to {summary['seed'] + trials - 1}"


def _yes_or_share(inside: bool | float | None) -> str:
    """Yes or no of one run, the share of several trials."""
    return {True: "yes", False: "no", None: "-"}[inside] if inside is None or isinstance(inside, bool) else f"{100 * inside:.0f} %"


def _missed(outcome: Mapping[str, Any] | None) -> str:
    if outcome is None:
        return "-"
    if outcome.get("bearing_error_deg") is not None:
        return f"{outcome['bearing_error_deg']:.1f} deg"
    return number(outcome["source_error_m"])
