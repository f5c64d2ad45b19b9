"""`python -m oio.bench stereo`: both elements of a pair at one place or two, in turn or together; what does the gradient give?"""

import itertools
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from rich.markup import escape

from oio.bench.arguments import Arguments, read
from oio.bench.boards import BOARDS, BoardCase, BoardTrial, Row, rows
from oio.bench.output_folder import claim_folder
from oio.bench.parallel import run_parallel
from oio.bench.score import Case, Score, scored
from oio.bench.trial import composed_trial, try_trial
from oio.cli import terminal
from oio.cli.csv_file import CsvFile, Record, names, write
from oio.cli.table_layout import print_table
from oio.core.errors import BadInput

TABLE, TRIALS = "stereo.csv", "trials.csv"
FIELDS = [*Case._fields, "board", "seed", *names(Score), "reason"]
HEADS = (
    "n\n(failed)", "found\n[%]", "false", "in 95 %\nregion [%]", "error [mm]\nmedian", "moves\nmedian",
    "found less\nthe first [%]", "error over\nthe first's", "moves less\nthe first's",
)  # fmt: skip


def run(arguments: list[str]) -> None:
    """Run the command: trials, seed by seed, and table. After Ctrl-C the seeds that are finished in every case are summarised."""
    words = read("stereo", arguments)
    spacing_m, cases = words.number("spacing_m"), plan_cases(words)
    tasks = list(itertools.product(words.wholes("seeds"), cases))
    out = claim_folder(words.own["out"], "stereo", (TABLE, TRIALS))
    work = [((*case.words(spacing_m), *words.overrides), seed) for seed, case in tasks]
    sd_m = float(composed_trial(work[0][0])[0]["stop"]["sd_m"])
    false_mm, found, stop, sheet = 1e3 * words.number("found_sd") * sd_m, dict[int, BoardTrial](), None, CsvFile(out / TRIALS, FIELDS)
    try:
        for number, (document, reason) in run_parallel(try_trial, work, words.whole("jobs", 1), "trials"):
            seed, case = tasks[number]
            trial = scored(case.case, seed, document, reason, false_mm)
            found[number] = BoardTrial(case, seed, trial.score, trial.reason)
            sheet.add(_csv_record(found[number]))
    except KeyboardInterrupt as interrupt:
        stop = interrupt
    sheet.close()
    trials = [found[number] for number in sorted(found)]
    counts = Counter(trial.seed for trial in trials)
    whole = [trial for trial in trials if counts[trial.seed] == len(cases)]
    write(out / TRIALS, FIELDS, map(_csv_record, trials))
    if whole:
        write_summary(whole, out)
    if stop is not None:
        raise stop


def plan_cases(words: Arguments) -> list[BoardCase]:
    """Return all cases, each composed once; raises BadInput before anything is run."""
    boards = words.several("board")
    unknown = [board for board in boards if board not in BOARDS]
    if unknown:
        raise BadInput(
            f"board={words.own['board']} was given, but a board is one of {', '.join(BOARDS)}. Type e.g. board={','.join(BOARDS)}."
        )
    if min(words.wholes("dof")) < 3:
        raise BadInput(f"dof={words.own['dof']} was given, but a position takes three joints at least. Type e.g. dof=5.")
    lists = words.several("sensor"), words.several("air"), words.wholes("dof"), words.several("search"), words.several("ekf"), boards
    combinations = itertools.product(*lists)
    cases = [BoardCase(Case(sensor, air, dof, search, ekf), board) for sensor, air, dof, search, ekf, board in combinations]
    for case in cases:
        _, built = composed_trial((*case.words(words.number("spacing_m")), *words.overrides))
        if built.sensor.elements < 2:
            raise BadInput(f"sensor={case.case.sensor} has one element, but a pair takes two. Type e.g. sensor=ec.")
    return cases


def write_summary(trials: Sequence[BoardTrial], out: Path) -> None:
    """Write stereo.csv, and print the table."""
    found = rows(trials)
    records = ({**case.case._asdict(), "board": case.board, **asdict(row)} for case, row in found.items())
    write(out / TABLE, [*Case._fields, "board", *names(Row)], records)
    title, keys = "two elements on the board; brackets are 95 % intervals", ("sensor", "air", "search", "board")
    cells = [(case.case.sensor, case.case.air, case.case.search, case.board, *_cells(row)) for case, row in found.items()]
    print_table(terminal.console(), title, (*keys, *HEADS), cells, len(keys))
    console = terminal.console(soft_wrap=True)
    for reason, count in Counter(trial.reason for trial in trials if trial.score is None).items():
        console.print(f"{count} failed: {escape(reason)}")
    console.print(f"tables are in {escape(str(out))}")


def _cells(r: Row) -> tuple[str, ...]:
    return (
        f"{r.trials} ({r.failed})", _between(100 * r.found_share, 100 * r.found_low, 100 * r.found_high),
        str(r.false), f"{100 * r.covered:.0f}", _between(r.median_mm, r.median_low_mm, r.median_high_mm, 1), f"{r.moves:.0f}",
        _between(100 * r.d_found, 100 * r.d_found_low, 100 * r.d_found_high), _between(r.ratio, r.ratio_low, r.ratio_high, 2),
        _between(r.d_moves, r.d_moves_low, r.d_moves_high),
    )  # fmt: skip


def _between(value: float, low: float, high: float, digits: int = 0) -> str:
    return "-" if np.isnan(value) else f"{value:.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]"


def _csv_record(trial: BoardTrial) -> Record:
    score: dict[str, Any] = asdict(trial.score) if trial.score is not None else {}
    return {**trial.case.case._asdict(), "board": trial.case.board, "seed": trial.seed, **score, "reason": trial.reason}
