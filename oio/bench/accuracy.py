"""`python -m oio.bench accuracy`: Monte Carlo of source error and consistency (coverage, NEES) over many seeds."""

import itertools
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from joblib.externals.loky.process_executor import TerminatedWorkerError

from oio.bench.arguments import Arguments, read
from oio.bench.case_summary import Row, rows
from oio.bench.output_folder import claim_folder
from oio.bench.parallel import run_parallel
from oio.bench.score import Case, Trial, scored
from oio.bench.table import show
from oio.bench.trial import composed_trial, try_trial
from oio.bench.trial_file import FIELDS, TRIALS
from oio.cli.csv_file import CsvFile, Record, names, write
from oio.cli.help import choices
from oio.core.errors import BadInput, OioError
from oio.core.folders import CONF
from oio.sweep.table_1 import table_1

GROUPS = ("sensor", "air", "search", "ekf", "world")
PER_JOB = 4  # batch size of a worker: mostly trials of one case, so that it seldom composes another
TABLE, FIGURE = "accuracy.csv", "accuracy.png"


@dataclass(frozen=True)
class Plan:
    """The trials to run, and the error above which a declared source is a false declaration."""

    cases: tuple[Case, ...]
    seeds: tuple[int, ...]
    overrides: tuple[str, ...]
    false_mm: float
    apart: bool = False  # each world has seeds of its own, which begin where those of the one before end

    @property
    def tasks(self) -> list[tuple[Case, int]]:
        """Every case with every seed, case by case: a worker composes few configurations."""
        worlds = list(dict.fromkeys(case.world for case in self.cases))
        step = max(self.seeds) - min(self.seeds) + 1 if self.apart else 0
        return [(case, seed + step * worlds.index(case.world)) for case, seed in itertools.product(self.cases, self.seeds)]


def run(arguments: list[str]) -> None:
    """Run the command: trials, table, figure. After Ctrl-C the finished trials are summarised."""
    words = read("accuracy", arguments)
    plan, jobs = plan_cases(words), words.whole("jobs", 1)
    out = claim_folder(words.own["out"], "accuracy", (TABLE, TRIALS, FIGURE))
    trials, stop = run_trials(plan, jobs, out)
    if trials:
        write_summary(trials, out)
    if stop is not None:
        raise stop


def plan_cases(words: Arguments) -> Plan:
    """Return the cases, with each value of each key checked; raises BadInput before anything is run."""
    keys = {key: words.several(key) for key in GROUPS}
    if min(words.wholes("dof")) < 3:
        raise BadInput(f"dof={words.own['dof']} was given, but a position takes three joints at least. Type e.g. dof=3,5.")
    combinations = itertools.product(keys["sensor"], keys["air"], words.wholes("dof"), keys["search"], keys["ekf"], keys["world"])
    cases = tuple(Case(*values) for values in combinations)
    cfg, _ = composed_trial((*cases[0].words, *words.overrides))
    for case in _cases_to_check(cases, keys):
        composed_trial((*case.words, *words.overrides))
    apart = "apart" in words.own and words.yes("apart")
    return Plan(cases, words.wholes("seeds"), words.overrides, 1e3 * words.number("found_sd") * float(cfg["stop"]["sd_m"]), apart)


def _cases_to_check(cases: tuple[Case, ...], keys: dict[str, tuple[str, ...]]) -> list[Case]:
    """A case for every DoF rung, and for every choice that is not in conf/: it comes from a plug-in, or Hydra raises."""
    first = cases[0]
    known = {key: dict(choices(CONF, key)) for key in GROUPS}
    external = [Case(**{**first._asdict(), key: value}) for key in GROUPS for value in keys[key] if value not in known[key]]
    return external + [first._replace(dof=dof) for dof in dict.fromkeys(case.dof for case in cases)]


def run_trials(plan: Plan, jobs: int, out: Path) -> tuple[list[Trial], BaseException | None]:
    """Run all trials and write trials.csv, in order; if stopped, return the finished ones and the exception."""
    found = dict[int, Trial]()
    stop: BaseException | None = None
    sheet = CsvFile(out / TRIALS, FIELDS)  # in order of completion: what a killed benchmark leaves
    tasks = [((*case.words, *plan.overrides), seed) for case, seed in plan.tasks]
    try:
        for number, (document, reason) in run_parallel(try_trial, tasks, jobs, "trials", PER_JOB):
            found[number] = scored(*plan.tasks[number], document, reason, plan.false_mm)
            sheet.add(_csv_record(found[number]))
    except KeyboardInterrupt as interrupt:
        stop = interrupt
    except TerminatedWorkerError:
        stop = OioError(f"a worker process died; {len(found)} of {len(tasks)} trials were done. Memory may be short: type jobs=1.")
    sheet.close()
    trials = [found[number] for number in sorted(found)]
    write_trials(trials, out)
    return trials, stop


def write_summary(trials: list[Trial], out: Path) -> None:
    """Write accuracy.csv and accuracy.png, and print the table."""
    from oio.figures.accuracy import draw  # here: matplotlib takes a second to import, and workers do without

    found = rows(trials, table_1(CONF))
    write(out / TABLE, [*Case._fields, *names(Row)], ({**case._asdict(), **asdict(row)} for case, row in found.items()))
    draw(trials, found, out / FIGURE)
    show(found, Counter(trial.reason for trial in trials if trial.score is None), str(out))


def write_trials(trials: Iterable[Trial], out: Path) -> None:
    """Write trials.csv."""
    write(out / TRIALS, FIELDS, map(_csv_record, trials))


def _csv_record(trial: Trial) -> Record:
    score: dict[str, Any] = asdict(trial.score) if trial.score is not None else {}
    return {**trial.case._asdict(), "seed": trial.seed, **score, "reason": trial.reason}
