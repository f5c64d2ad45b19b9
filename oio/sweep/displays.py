"""What `python -m oio.sweep status | table | compare | worst` show in the terminal."""

import argparse
from collections import Counter
from typing import Any

import numpy as np
from rich.markup import escape

from oio.cli import terminal
from oio.cli.count_progress import in_words
from oio.cli.table_layout import print_table
from oio.sweep.compare import compare
from oio.sweep.group_table import group_table
from oio.sweep.manifest import Manifest, is_running
from oio.sweep.rate import seconds_left
from oio.sweep.records import error_of, records, shown_error
from oio.sweep.row_display import show_rows
from oio.sweep.sheet import save, text
from oio.sweep.worst import worst


def status(given: argparse.Namespace) -> None:
    """Print how far the sweep is."""
    manifest = Manifest.read(given.dir)
    outcomes = manifest.outcomes()
    states, console = Counter(outcome.state for outcome in outcomes), terminal.console(soft_wrap=True, highlight=False)
    told = ", ".join(f"{count} {'not begun' if state == 'missing' else state}" for state, count in states.items())
    console.print(f"{len(outcomes)} jobs in {escape(str(given.dir))}: {told}")
    going = is_running(given.dir)
    pace = seconds_left(given.dir, outcomes)
    if going and pace is not None:
        console.print(f"running, {pace[0]:.1f} jobs a minute, about {in_words(pace[1])} left")
    elif going:
        console.print("running")
    for outcome in outcomes:
        if outcome.state == "running":
            console.print(f"  running: {escape(outcome.job.folder)}")
        if outcome.error and outcome.state in ("failed", "outdated", "killed"):
            console.print(f"  {outcome.state}: {escape(outcome.job.folder)}: {escape(outcome.error.splitlines()[0])}")
    if not going and states["done"] < len(outcomes):
        console.print(f"not running; go on with: python -m oio.sweep resume {escape(str(given.dir))}")


def table(given: argparse.Namespace) -> None:
    """Print the table by groups, and write it to a file."""
    rows = records(Manifest.read(given.dir).outcomes())
    found = rows if given.by == "job" else group_table(rows, given.by.split(",") if given.by else None)
    if given.out is not None:
        save(found, given.out)
    if given.by != "job" or given.out is None:
        show_rows(found, f"{len(rows)} jobs, {given.dir}; [low, high] are 95 % bootstrap intervals")
    if given.out is not None:
        terminal.console(soft_wrap=True).print(f"{len(found)} rows are in {given.out}", markup=False)


def comparison(given: argparse.Namespace) -> None:
    """Print the comparison of two sweeps."""
    told, console = compare(given.dir_a, given.dir_b), terminal.console(soft_wrap=True, highlight=False)
    low, high = told.ratio_interval
    console.print(f"{len(told.a)} pairs by {', '.join(told.paired_by)}; {told.unpaired} jobs without a partner", markup=False)
    console.print(f"error of B over that of A: {told.ratio:.3f} [{low:.3f}, {high:.3f}] (geometric mean, 95 % bootstrap)", markup=False)
    nearer = f"B is nearer in {int((told.b < told.a).sum())} of {len(told.a)}"
    console.print(f"medians: A {_median(told.a)} {told.unit}, B {_median(told.b)} {told.unit}; {nearer}")
    if told.differs:
        print_table(terminal.console(), "what differs in config.yaml", ("key", "A", "B"), told.differs[:40], 3)
    else:
        console.print("the configurations are equal")
    if len(told.differs) > 40:
        console.print(f"and {len(told.differs) - 40} keys more")


def _median(errors: Any) -> str:
    return f"{np.median(errors):.1f}"


def worst_jobs(given: argparse.Namespace) -> None:
    """Print the jobs to look at first."""
    rows = records(Manifest.read(given.dir).outcomes())
    found, console = worst(rows, given.count), terminal.console(soft_wrap=True, highlight=False)
    if not found:
        return console.print(f"nothing among {len(rows)} jobs is failed, wrong or far off", markup=False)
    shown = []
    for row, why in found:
        missed = "" if error_of(row) is None else "{:.1f} {}".format(*shown_error(row))
        sd = row.get("calibrated.sd_m")
        shown.append([row["job"], why, missed, "" if sd is None else f"{1e3 * sd:.1f} mm", *(text(row.get(key), 3) for key in KEYS)])
    print_table(terminal.console(), f"the jobs of {given.dir} to look at first", WORST_HEADS, shown, 2)
    console.print(f"see one: python -m oio.figures {given.dir / found[0][0]['job']}", markup=False)


WORST_HEADS = ("job", "why", "error", "sd", "NEES", "verdict", "scored")
KEYS = ("calibrated.nees_source", "verdict", "scored.word")
