"""`python -m oio.bench worlds`: searches in worlds that changed after calibration; is the answer right, and is a wrong one admitted?"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from rich.markup import escape

from oio.bench.accuracy import plan_cases, run_trials, write_trials
from oio.bench.arguments import Arguments, read
from oio.bench.output_folder import claim_folder
from oio.bench.score import Score, Trial
from oio.bench.trial_file import TRIALS, read_trials
from oio.cli import terminal
from oio.cli.csv_file import names, write
from oio.cli.table_layout import print_table
from oio.core.errors import BadInput
from oio.results.statistics import wilson

TABLE, FIGURE, ALL = "worlds.csv", "worlds.png", "all"
KEYS = ("world", "sensor", "air")
HEADS = (
    "n\n(failed)", "error [mm]\nmedian / 95 %", "in 95 %\nregion [%]", "declared\n[%]", "declared, but wrong\n[% of declared]",
    "PASS, but wrong\n[% of PASS]", "moves", "world assumed",
)  # fmt: skip
NAN = float("nan")


@dataclass(frozen=True, slots=True)
class Row:
    """Trials of one world, sensor and air; shares with the ends of their 95 % intervals (Wilson)."""

    world: str
    sensor: str
    air: str
    trials: int
    failed: int
    median_mm: float
    p95_mm: float
    covered: float  # share of trials whose 95 % region holds the source, that of every place that is left
    covered_low: float
    covered_high: float
    covered_best: float  # likewise, that of the best place alone
    declared: int
    false: int  # declared, but far from the source or outside the three-sigma region
    false_share: float  # of the declared ones
    false_low: float
    false_high: float
    passed: int  # verdict PASS
    wrong_pass: int  # of those, wrong
    wrong_pass_share: float
    wrong_pass_low: float
    wrong_pass_high: float
    moves: float  # median
    assumed: str  # the world that most of the trials assume in the end


def run(arguments: list[str]) -> None:
    """Run the command: trials, table, figure. After Ctrl-C the finished trials are summarised."""
    words = read("worlds", arguments)
    by = _groups(words)
    plan, jobs = plan_cases(words), words.whole("jobs", 1)
    earlier = read_trials(words.several("from")) if words.own["from"] != "null" else []
    out = claim_folder(words.own["out"], "worlds", (TABLE, TRIALS, FIGURE))
    trials, stop = (earlier, None) if earlier else run_trials(plan, jobs, out)
    if earlier:
        write_trials(trials, out)
    if trials:
        write_summary(trials, by, out)
    if stop is not None:
        raise stop


def _groups(words: Arguments) -> tuple[str, ...]:
    by = words.several("by")
    wrong = [key for key in by if key not in KEYS]
    if wrong:
        raise BadInput(f"by={words.own['by']} was given, but rows are by {', '.join(KEYS)}. Type e.g. by=world.")
    return by


def rows(trials: Sequence[Trial], by: Sequence[str] = KEYS) -> list[Row]:
    """Return a row per world, sensor and air, or some of these, in the order of their first trials, and one of all together."""
    groups = dict[tuple[str, str, str], list[Trial]]()
    for trial in trials:
        world, sensor, air = (str(getattr(trial.case, key)) if key in by else "" for key in KEYS)
        groups.setdefault((world, sensor, air), []).append(trial)
    return [*(_row(key, group) for key, group in groups.items()), _row((ALL, "", ""), list(trials))]


def _row(key: tuple[str, str, str], trials: list[Trial]) -> Row:
    scores = [t.score for t in trials if t.score is not None]
    errors, n = np.array([s.error_mm for s in scores]), len(scores)
    declared, passed = [s for s in scores if s.declared], [s for s in scores if s.passed]
    false, wrong = sum(s.wrong for s in declared), sum(s.wrong for s in passed)
    covered, best = sum(s.in_region for s in scores), sum(s.inside_95 for s in scores)
    (covered_low, covered_high), (false_low, false_high), (wrong_low, wrong_high) = (
        wilson(count, total) if total else (NAN, NAN) for count, total in ((covered, n), (false, len(declared)), (wrong, len(passed)))
    )
    world, sensor, air = key
    return Row(
        world=world, sensor=sensor, air=air, trials=len(trials), failed=len(trials) - n,
        median_mm=float(np.median(errors)) if n else NAN, p95_mm=float(np.quantile(errors, 0.95)) if n else NAN,
        covered=_share(covered, n), covered_low=covered_low, covered_high=covered_high, covered_best=_share(best, n),
        declared=len(declared), false=false, false_share=_share(false, len(declared)), false_low=false_low, false_high=false_high,
        passed=len(passed), wrong_pass=wrong, wrong_pass_share=_share(wrong, len(passed)),
        wrong_pass_low=wrong_low, wrong_pass_high=wrong_high,
        moves=float(np.median([s.moves for s in scores])) if n else NAN, assumed=_assumed(scores),
    )  # fmt: skip


def _assumed(scores: list[Score]) -> str:
    counts = Counter(score.assumed_world for score in scores)
    return ", ".join(f"{world} {count}" for world, count in counts.most_common(2))


def _share(count: int, total: int) -> float:
    return count / total if total else NAN


def write_summary(trials: list[Trial], by: Sequence[str], out: Path) -> None:
    """Write worlds.csv and worlds.png, and print the table."""
    from oio.figures.worlds import draw  # here: matplotlib takes a second to import, and workers do without

    found = rows(trials)
    write(out / TABLE, names(Row), (asdict(row) for row in found))
    draw(found[:-1], out / FIGURE)
    show(rows(trials, by), by, Counter(trial.reason for trial in trials if trial.score is None), str(out))


def show(found: Sequence[Row], by: Sequence[str], failures: Counter[str], where: str) -> None:
    """Print the table of rows that are by these keys, the reasons of failures, and the output folder."""
    title = "worlds that changed after calibration; brackets are 95 % intervals"
    *groups, together = ((*(getattr(row, key) for key in by), *_cells(row)) for row in found)
    lines = [*groups, (ALL, *("" for _ in by[1:]), *together[len(by) :])]
    print_table(terminal.console(), title, (*by, *HEADS), lines, len(by))
    console = terminal.console(soft_wrap=True)
    for reason, count in failures.items():
        console.print(f"{count} failed: {escape(reason)}")
    console.print(f"tables and figure are in {escape(where)}")


def _cells(r: Row) -> tuple[str, ...]:
    return (
        f"{r.trials} ({r.failed})", f"{r.median_mm:.1f} / {r.p95_mm:.0f}",
        _percent(r.covered, r.covered_low, r.covered_high), f"{100 * _share(r.declared, r.trials - r.failed):.0f}",
        f"{r.false} of {r.declared}, {_percent(r.false_share, r.false_low, r.false_high)}",
        f"{r.wrong_pass} of {r.passed}, {_percent(r.wrong_pass_share, r.wrong_pass_low, r.wrong_pass_high)}", f"{r.moves:.0f}", r.assumed,
    )  # fmt: skip


def _percent(share: float, low: float, high: float) -> str:
    return "-" if np.isnan(share) else f"{100 * share:.0f} [{100 * low:.0f}-{100 * high:.0f}]"
