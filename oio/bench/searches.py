"""`python -m oio.bench searches`: search strategies side by side on the same calibrated benches, sources, turbulence and noise."""

import itertools
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from oio.api.setup import in_one_paragraph
from oio.bench.arguments import read
from oio.bench.episode import Bench, Episode, made
from oio.bench.output_folder import claim_folder
from oio.bench.parallel import run_parallel
from oio.bench.trial import composed_trial
from oio.cli import terminal
from oio.cli.csv_file import CsvFile, names
from oio.cli.table_layout import print_table
from oio.core.errors import OioError
from oio.results.calibration import Calibration
from oio.results.statistics import wilson
from oio.search.closed_loop import ClosedLoop
from oio.search.loop_settings import LoopSettings

TRIALS = "searches.csv"
HEADS = (
    "n\n(failed)", "declared and\nright [%]", "declared,\nbut wrong", "error [mm]\nmedian / 90 %", "moves\nmedian", "time [s]\nmedian",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Search:
    """One search: its source error [mm], whether the source was declared, and whether wrongly, moves and time [s]; NaN and a reason if it
    failed."""

    sensor: str
    air: str
    search: str
    seed: int
    error_mm: float
    declared: bool
    wrong: bool
    moves: int
    time_s: float
    reason: str = ""


def run(arguments: list[str]) -> None:
    """Run the command: a calibration per seed, and every search from there; writes searches.csv and prints a row per search."""
    words = read("searches", arguments)
    searches, overrides = words.several("search"), (f"dof={words.whole('dof', 3)}", *words.overrides)
    kinds = tuple(itertools.product(words.several("sensor"), words.several("air")))
    for (sensor, air), search in itertools.product(kinds, searches):
        with in_one_paragraph():
            composed_trial((f"sensor={sensor}", f"air={air}", *overrides, f"search={search}"))
    found_sd_mm = 1e3 * words.number("found_sd")
    tasks = [(kind, seed, searches, overrides, found_sd_mm) for seed in words.wholes("seeds") for kind in kinds]
    out = claim_folder(words.own["out"], "searches", (TRIALS,))
    sheet, found = CsvFile(out / TRIALS, names(Search)), list[Search]()
    try:
        for _, made_there in run_parallel(searched_all, tasks, words.whole("jobs", 1), "benches"):
            found += made_there
            for search in made_there:
                sheet.add(asdict(search))
    finally:
        sheet.close()
        if found:
            show(found, searches, str(out))


def searched_all(
    kind: tuple[str, str], seed: int, searches: Sequence[str], overrides: tuple[str, ...], found_sd_mm: float
) -> list[Search]:  # fmt: skip
    """Return every search from one calibrated bench; a search that fails does not stop the others."""
    words = (f"sensor={kind[0]}", f"air={kind[1]}", *overrides)
    try:
        bench = made(words, seed, "navigate")
    except OioError as error:
        return [Search(*kind, name, seed, np.nan, False, False, 0, np.nan, str(error)) for name in searches]
    return [searched(bench, kind, seed, name, (*words, f"search={name}"), found_sd_mm) for name in searches]


def searched(bench: Bench, kind: tuple[str, str], seed: int, name: str, words: tuple[str, ...], found_sd_mm: float) -> Search:
    """Return one search, which is that of `python -m oio.run` with these words and this seed."""
    settings, own = bench.experiment.stages["navigate"], composed_trial(words)[1].stages["navigate"]
    assert isinstance(settings, LoopSettings) and isinstance(own, LoopSettings)
    episode = Episode(bench, None, seed)
    calibration = episode.context.need(Calibration)
    try:
        with episode.attended():
            loop = ClosedLoop(replace(settings, search=own.search), episode.context, calibration.chosen, calibration.baselines)
            while not loop.over:
                loop.move(loop.proposed())
            loop.finish()
    except OioError as error:
        return Search(*kind, name, seed, np.nan, False, False, 0, np.nan, str(error))
    source, truth = loop.odometry.source(), episode.log.truth
    assert truth is not None
    error_mm = np.nan if source is None else 1e3 * float(np.linalg.norm(source[0] - truth.source_m))
    wrong = loop.declared and error_mm > found_sd_mm * settings.stop.sd_m
    return Search(*kind, name, seed, error_mm, loop.declared, wrong, len(loop.moves), loop.spent_s)


def show(found: Sequence[Search], searches: Sequence[str], where: str) -> None:
    """Print a row per kind and search, the reasons of failures, and the output folder."""
    kinds = dict.fromkeys((search.sensor, search.air) for search in found)
    rows = [
        [*kind, name, *_cells([one for one in found if (one.sensor, one.air, one.search) == (*kind, name)])]
        for kind in kinds
        for name in searches
    ]
    print_table(
        terminal.console(), "searches on the same benches; brackets are 95 % intervals", ("sensor", "air", "search", *HEADS), rows, 3
    )
    console = terminal.console(soft_wrap=True)
    for reason in sorted({search.reason for search in found if search.reason}):
        console.print(f"{sum(search.reason == reason for search in found)} failed: {reason}", markup=False)
    console.print(f"the table of all searches is in {where}", markup=False)


def _cells(searches: Sequence[Search]) -> tuple[str, ...]:
    done = [search for search in searches if not search.reason]
    if not done:
        return (f"{len(searches)} ({len(searches)})", "-", "-", "-", "-", "-")
    right, declared = sum(one.declared and not one.wrong for one in done), sum(one.declared for one in done)
    low, high = wilson(right, len(done))
    errors = [one.error_mm for one in done if np.isfinite(one.error_mm)] or [np.nan]
    return (
        f"{len(searches)} ({len(searches) - len(done)})", f"{100 * right / len(done):.0f} [{100 * low:.0f}-{100 * high:.0f}]",
        f"{sum(one.wrong for one in done)} of {declared}", f"{np.median(errors):.1f} / {np.quantile(errors, 0.9):.0f}",
        f"{np.median([one.moves for one in done]):.0f}", f"{np.median([one.time_s for one in done]):.0f}",
    )  # fmt: skip
