"""`python -m oio.bench drift`: nose error of the filter under encoder drift, against dead reckoning, minutes after the start."""

import itertools
from dataclasses import asdict
from pathlib import Path

from oio.bench.arguments import Arguments, read
from oio.bench.drift_table import Row, Trials, rows, show
from oio.bench.drift_trial import SOURCES, Case, Times, try_trial
from oio.bench.nose_error import NoseErrorSample
from oio.bench.output_folder import claim_folder
from oio.bench.parallel import run_parallel
from oio.bench.trial import composed_trial
from oio.cli.csv_file import names, write
from oio.core.errors import BadInput

TABLE, TRIALS, FIGURE = "drift.csv", "trials.csv", "drift.png"


def run(arguments: list[str]) -> None:
    """Run the command: trials, table, figure. After Ctrl-C the finished trials are summarised."""
    words = read("drift", arguments)
    times = Times(tuple(sorted(float(t) for t in words.wholes("after_s"))), words.number("window_s"), words.number("dwell_s"))
    cases = plan_cases(words, times)
    tasks = list(itertools.product(cases, words.wholes("seeds")))
    out = claim_folder(words.own["out"], "drift", (TABLE, TRIALS, FIGURE))
    work = [((*case.words(times.after_s[-1]), *words.overrides), case.source, seed, times) for case, seed in tasks]
    found: dict[int, tuple[list[NoseErrorSample], str]] = {}
    stop: BaseException | None = None
    try:
        found.update(run_parallel(try_trial, work, words.whole("jobs", 1), "drift"))
    except KeyboardInterrupt as interrupt:
        stop = interrupt
    if found:
        write_summary([(*tasks[i], *found[i]) for i in sorted(found)], times, out)
    if stop is not None:
        raise stop


def plan_cases(words: Arguments, times: Times) -> list[Case]:
    """Return all cases, each built once; raises BadInput before anything is run."""
    unknown = [source for source in words.several("source") if source not in SOURCES]
    if unknown or min(words.wholes("dof")) < 3:
        raise BadInput(
            f"source={words.own['source']} dof={words.own['dof']} was given, but source is a list of {', '.join(SOURCES)}, "
            f"and a nose needs three joints to be found. Type e.g. source=known dof=5."
        )
    lists = words.several("sensor"), words.several("air"), words.wholes("dof"), words.several("ekf"), words.several("source")
    cases = [Case(*values) for values in itertools.product(*lists)]
    for case in cases:
        composed_trial((*case.words(times.after_s[-1]), *words.overrides))
    return cases


def write_summary(trials: Trials, times: Times, out: Path) -> None:
    """Write drift.csv, trials.csv and drift.png, and print the table."""
    from oio.figures.drift import draw

    lines = [{**case._asdict(), "seed": seed, **asdict(at)} for case, seed, ats, _ in trials for at in ats]
    failed = [{**case._asdict(), "seed": seed, "reason": reason} for case, seed, ats, reason in trials if reason]
    write(out / TRIALS, [*Case._fields, "seed", *names(NoseErrorSample), "reason"], [*lines, *failed])
    found = {case: rows([t for t in trials if t[0] == case], times) for case in dict.fromkeys(t[0] for t in trials)}
    write(out / TABLE, [*Case._fields, *names(Row)], ({**case._asdict(), **asdict(row)} for case, rs in found.items() for row in rs))
    draw({case: [ats for c, _, ats, _ in trials if c == case] for case in found}, out / FIGURE)
    show(found, sorted({reason for *_, reason in trials if reason}), str(out))
