"""Summary statistics over the trials of `drift`, and their table on the screen."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from rich.markup import escape

from oio.bench.drift_trial import Case, Times
from oio.bench.nose_error import NoseErrorSample
from oio.cli import terminal
from oio.cli.table_layout import print_table

Trials = Sequence[tuple[Case, int, list[NoseErrorSample], str]]  # case, seed, errors, reason of a failure
HEADS = ("after [s]", "n", "failed", "filter [mm]", "worst", "claimed", "in 95 % [%]", "dead reckoning [mm]", "ratio")


@dataclass(frozen=True, slots=True)
class Row:
    """Medians over seeds; `inside_95` is the share of instants and seeds inside the 95 % region."""

    after_s: float
    trials: int
    failed: int
    nose_mm: float
    worst_mm: float
    dead_reckoning_mm: float
    gain: float  # dead reckoning / filter
    claimed_mm: float
    inside_95: float


def rows(trials: Trials, times: Times) -> list[Row]:
    """Return one row for each evaluation time."""
    return [_row(trials, t) for t in times.after_s]


def _row(trials: Trials, after_s: float) -> Row:
    errors = [at for _, _, series, _ in trials for at in series if at.after_s == after_s]
    if not errors:
        return Row(after_s, len(trials), len(trials), *[math.nan] * 6)
    nose, dead = np.array([at.nose_mm for at in errors]), np.array([at.dead_reckoning_mm for at in errors])
    return Row(
        after_s, len(trials), len(trials) - len(errors), float(np.median(nose)), float(np.max(nose)), float(np.median(dead)),
        float(np.median(dead) / np.median(nose)), float(np.median([at.claimed_mm for at in errors])),
        float(np.mean([at.inside_95 for at in errors])),
    )  # fmt: skip


def show(found: Mapping[Case, list[Row]], reasons: Sequence[str], where: str) -> None:
    """Print the nose errors at the evaluation times."""
    shown = [[*map(str, case), *_cells(r)] for case, rs in found.items() for r in rs]
    names = len(Case._fields)
    print_table(terminal.console(), "error of the nose's position, medians over seeds", (*Case._fields, *HEADS), shown, names)
    console = terminal.console(soft_wrap=True)
    for reason in reasons:
        console.print(f"failed: {escape(reason)}")
    console.print(f"tables and figure are in {escape(where)}")


def _cells(r: Row) -> tuple[str, ...]:
    return (
        f"{r.after_s:g}", str(r.trials), str(r.failed), f"{r.nose_mm:.1f}", f"{r.worst_mm:.1f}", f"{r.claimed_mm:.1f}",
        f"{100 * r.inside_95:.0f}", f"{r.dead_reckoning_mm:.1f}", f"{r.gain:.1f}",
    )  # fmt: skip
