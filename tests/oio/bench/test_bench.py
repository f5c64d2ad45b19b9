"""Benchmarks: a trial is a run, the order of coming does not matter, and statistics are what their formulas say."""

import csv
import json
import math
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binom

from oio.bench import __main__ as command
from oio.bench import accuracy
from oio.bench.arguments import defaults, read
from oio.bench.case_summary import Row, rows
from oio.bench.parallel import run_parallel
from oio.bench.score import Case, Score, Trial, scored
from oio.bench.trial import composed_trial, experiment, run_trial, try_trial
from oio.cli.build import build
from oio.cli.execute import execute
from oio.core.errors import BadInput
from oio.core.records import Event, GasSample
from oio.log import MemoryLog, Progress, StageMark
from oio.results.statistics import anees_band, rms_ratio, wilson
from oio.sweep.table_1 import Published

pytestmark = pytest.mark.long

SHORT = (
    "sensor=ndir", "air=steady", "dof=3", "search=d_optimal", "ekf=ekf", "stage.navigate.max_moves=7", "stage.map_beliefs.repeats=2",
    "stage.map_beliefs.budget_s=0", "stage.calibrate_bouts.moves_per_rung=2",
)  # fmt: skip
CASE = Case("ndir", "steady", 3, "d_optimal", "ekf")
EXTRA = SHORT[5:]


# ---- a trial


@pytest.fixture(scope="module")
def in_memory():
    return run_trial(SHORT, 4)


def test_a_trial_has_no_protocol():
    with pytest.raises(BadInput, match="protocol=emulated was given, but a benchmark asks nobody"):
        run_trial(("protocol=emulated",), 0)


def test_a_trial_is_a_run_bit_for_bit(in_memory, tmp_path, composed):
    """The numbers of summary.json, but for the time it took and the tree; no paper's assembly, and of the cold start one map."""
    made = build(composed(*SHORT, "seed=4", "stage.evaluate.cold_maps=last"), {"backend": "mujoco", "air": "steady", "ekf": "ekf"}, [])
    with_file = execute(made, tmp_path / "run")
    skipped = ("wall_s", "calibrated_paper_assembly", "reproducible")
    assert {k: v for k, v in in_memory.items() if k not in skipped} == {k: v for k, v in with_file.items() if k not in skipped}
    assert with_file["calibrated"]["source_error_m"] > 0 and in_memory["calibrated_paper_assembly"] is None


def test_a_trial_leaves_no_trace_in_the_next_one(in_memory):
    run_trial(SHORT, 5)
    assert run_trial(SHORT, 4) == in_memory


def test_what_stands_at_the_upper_rail_is_not_taken_for_a_value():
    """A cell whose amplifier ends at 217 ppm: a fit that believes the rail declares this source 49 mm from where it stands."""
    words = ("sensor=ec", "air=still", "dof=5", "sensor.adc_bits=10", "sensor.v_ref=5", "sensor.r_tia_ohm=35000")
    found = run_trial(words, 2006)["calibrated"]
    assert found["inside_95"] and found["source_error_m"] < 0.015


def test_every_seed_has_a_truth_of_its_own():
    assert [experiment(SHORT, seed).backend.seeds.truth for seed in (4, 0, 7)] == [4, 0, 7]


def test_a_failure_is_a_reason_and_no_exception():
    document, reason = try_trial((*SHORT[:5], "stage.warm_up.max_s=0.2"), 0)
    assert document is None and "raise stage.warm_up.max_s" in reason


def test_stages_without_a_score_are_refused():
    assert "a benchmark needs 'assemble_qr' and 'evaluate'" in try_trial(("stage=[warm_up,baseline]", "sensor=ndir"), 0)[1]


def test_the_paper_assembly_is_not_scored_and_the_cold_start_makes_one_map():
    cfg, _ = composed_trial(SHORT)
    assert cfg["stage"]["evaluate"]["paper_assembly"] is False and cfg["stage"]["evaluate"]["cold_maps"] == "last"


@given(st.lists(st.integers(0, 20)), st.integers(-1, 20), st.none() | st.integers(0, 20))
def test_the_log_in_memory_gives_back_what_lies_between(times, since, until):
    log, samples = MemoryLog(), [GasSample(t, 0, float(i)) for i, t in enumerate(sorted(times))]
    for sample in samples:
        log.write(sample)
        log.write(Event(sample.t_ns, "progress", "to a person"))
    assert list(log.samples(since, until)) == [s for s in samples if since < s.t_ns and (until is None or s.t_ns <= until)]


def test_the_log_in_memory_tells_its_watchers_as_the_file_does():
    log, told = MemoryLog(), []
    log.watchers.append(told.append)
    with log.stage("warm_up", lambda: 7) as close:
        log.progress(7, "slope", "1 ppm")
        close(None)
    marks = [entry for entry in told if not isinstance(entry, Event)]
    assert marks == [StageMark(7, "warm_up", "begin"), Progress(7, "warm_up", "slope", "1 ppm"), StageMark(7, "warm_up", "end")]


# ---- many of them


def slow_first(number):
    time.sleep(0.2 if number == 0 else 0.0)
    return number**2


@pytest.mark.parametrize("jobs", [1, 2])
def test_every_task_comes_once_with_its_number(jobs):
    assert sorted(run_parallel(slow_first, [(i,) for i in range(9)], jobs, "squares")) == [(i, i**2) for i in range(9)]


@pytest.mark.slow
def test_the_files_do_not_depend_on_the_number_of_processes(tmp_path):
    for jobs in ("1", "2"):
        assert command.main(["accuracy", *EXTRA, *_own(tmp_path / jobs, seeds="0:3", jobs=jobs)]) == 0
    for name in ("trials.csv", "accuracy.csv", "accuracy.png"):
        assert (tmp_path / "1" / name).read_bytes() == (tmp_path / "2" / name).read_bytes()


def _own(out, **more):
    own = {**CASE._asdict(), "out": out, **more}
    return [f"{key}={value}" for key, value in own.items()]


def sheet(path):
    return list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))


@pytest.fixture
def few(tmp_path, monkeypatch, in_memory):
    """The command with its trials made up: the second fails."""

    def made_up(words, seed):
        return (None, "it rained") if seed == 1 else (in_memory, "")

    monkeypatch.setattr(accuracy, "try_trial", made_up)
    monkeypatch.setattr(accuracy, "run_parallel", lambda work, tasks, *_: ((i, work(*t)) for i, t in reversed([*enumerate(tasks)])))
    return tmp_path / "out"


def test_the_command_leaves_tables_and_a_figure(few, capsys):
    assert command.main(["accuracy", *_own(few, seeds="0:3"), *EXTRA]) == 0
    trials = sheet(few / "trials.csv")
    assert [(t["seed"], t["reason"]) for t in trials] == [("0", ""), ("1", "it rained"), ("2", "")]
    (row,) = sheet(few / "accuracy.csv")
    assert (row["sensor"], row["trials"], row["failed"], row["paper_calibration_s"]) == ("ndir", "3", "1", "51")
    assert (few / "accuracy.png").read_bytes().startswith(b"\x89PNG")
    told = capsys.readouterr().out
    assert "1 failed: it rained" in told and f"tables and figure are in {few}" in told


def test_what_is_done_is_saved_when_it_is_stopped(few, monkeypatch, capsys, in_memory):
    def stopped(work, tasks, *_):
        yield 2, (in_memory, "")
        yield 0, (in_memory, "")
        raise KeyboardInterrupt

    monkeypatch.setattr(accuracy, "run_parallel", stopped)
    assert command.main(["accuracy", *_own(few, seeds="0:3"), *EXTRA]) == 130
    assert [t["seed"] for t in sheet(few / "trials.csv")] == ["0", "2"]
    assert (few / "accuracy.csv").is_file()
    assert capsys.readouterr().err == "oio: stopped; what was done is saved.\n"


def test_results_are_never_written_over(few, capsys):
    words = ["accuracy", *_own(few, seeds="0"), *EXTRA]
    assert (command.main(words), command.main(words)) == (0, 2)
    assert "results are never overwritten" in capsys.readouterr().err


# ---- words


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["fast"], "'fast' was given, but a benchmark is one of accuracy"),
        (["accuracy", "seeds"], "'seeds' was given, but a benchmark takes KEY=VALUE words"),
        (["accuracy", "--jobs=2"], "'--jobs=2' was given, but a benchmark takes KEY=VALUE words"),
        (["accuracy", "seed=3"], "Type e.g. seeds=3"),
        (["accuracy", "seeds=5:5"], "seeds=5:5 was given, but that is an empty range. Type e.g. seeds=5000:5020."),
        (["accuracy", "seeds=1,1"], "seeds is a list of different entries"),
        (["accuracy", "seeds=-1"], "'-1' is not a whole number, 0 or more"),
        (["accuracy", "jobs=0"], "'0' is not a whole number, 1 or more"),
        (["accuracy", "jobs=2", "jobs=3"], "jobs was given twice"),
        (["accuracy", "found_sd=nan"], "found_sd is a number above 0"),
        (["accuracy", "dof=2"], "a position takes three joints at least"),
        (["accuracy", "dof=4"], "It can be 1, 2, 3, 5"),
        (["accuracy", "sensor=ec,xx"], "sensor=xx was given, but sensor can be ec, mox_mics, mox_mq, ndir, pa."),
        (["accuracy", "senors=ec"], "'senors' is not a key of the configuration."),
        (["accuracy", "stop.sd_m=-1"], "stop.sd_m is -1"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_mistakes_are_refused_in_one_paragraph(words, said, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert command.main(words) == 2
    out, err = capsys.readouterr()
    assert said in err and err.startswith("oio: ") and err.count("\n") == 1 and out == ""
    assert not list(tmp_path.iterdir())


def test_help_shows_every_key(capsys):
    assert command.main(["accuracy", "--help"]) == 0
    told = capsys.readouterr().out
    assert all(f"  {key}:" in told for name in command.COMMANDS for key in defaults(name))


def test_seeds_that_nobody_chose_are_held_out():
    """Neither those that tuning looked at nor those that were reported before (see conf/bench.yaml)."""
    looked_at = {*range(10), *range(100, 108), *range(200, 208), *range(300, 336), *range(400, 434), *range(1000, 1010)}
    assert not looked_at & {*read("accuracy", []).wholes("seeds"), *read("drift", []).wholes("seeds")}
    assert set(read("accuracy", []).wholes("seeds")) <= set(range(5000, 5200))


def test_what_is_no_key_of_its_own_is_an_override():
    words = read("accuracy", ["seeds=3,7", "stop.sd_m=0.01", "jobs=1"])
    assert (words.wholes("seeds"), words.overrides, words.whole("jobs")) == ((3, 7), ("stop.sd_m=0.01",), 1)
    assert read("accuracy", []).wholes("seeds") == tuple(range(5000, 5020))


# ---- statistics


@given(st.integers(1, 500), st.data())
def test_wilson_lies_about_the_share_and_inside_the_unit(n, data):
    k = data.draw(st.integers(0, n))
    low, high = wilson(k, n)
    assert 0.0 <= low <= k / n + 1e-12 and k / n - 1e-12 <= high <= 1.0
    assert wilson(n - k, n) == pytest.approx((1 - high, 1 - low), abs=1e-12)


@pytest.mark.parametrize("p", [0.05, 0.3, 0.95])
def test_wilson_covers_about_as_often_as_it_says(p):
    n = 100
    hit = [low <= p <= high for low, high in (wilson(k, n) for k in range(n + 1))]
    assert 0.93 < float(np.sum(binom.pmf(range(n + 1), n, p)[hit])) < 0.97


def test_the_band_of_anees_holds_95_percent_of_honest_filters():
    rng, n = np.random.default_rng(0), 20
    anees = rng.chisquare(3, (4000, n)).mean(axis=1) / 3
    low, high = anees_band(n)
    assert 0.94 < np.mean((anees > low) & (anees < high)) < 0.96


@given(st.lists(st.floats(0.1, 100), min_size=1, max_size=9), st.floats(0.1, 10))
def test_errors_at_their_bounds_times_a_factor_give_the_factor(bounds, factor):
    assert rms_ratio([factor * b for b in bounds], bounds) == pytest.approx(factor)


def score(error, cold, declared=True, inside=True, bound=10.0):
    return Score(
        error_mm=error, nees=3.0, inside_95=inside, in_region=inside, bound_mm=bound,
        declared=declared, false=declared and error > 54, moves=9, time_s=error,
        nis=1.0, nose_mm=4.0, dead_reckoning_mm=8.0, cold_error_mm=cold,
        cold_open_error_mm=2 * cold, calibration_s=50.0, error_ppm=3.0, u_a_ppm=1.0, u_b_mm=5.0,
        filter_mm=2 * error, filter_nees=6.0, assumed_world="as calibrated", wrong=error > 54, passed=declared,
    )  # fmt: skip


def test_a_row_sums_up_its_trials():
    scores = [score(10, 40), score(20, 10, declared=False), score(60, 70, inside=False), None]
    trials = [Trial(CASE, i, s, "" if s else "rain") for i, s in enumerate(scores)]
    row = rows(trials, {"ndir": Published(51, 30)})[CASE]
    assert (row.trials, row.failed, row.median_mm, row.cold_mm, row.gain, row.wins) == (4, 1, 20, 40, 2, 2)
    assert (row.covered, row.anees, row.false, row.declared, row.declare_s) == (pytest.approx(2 / 3), 1.0, 0.5, pytest.approx(2 / 3), 60.0)
    assert row.over_bound == pytest.approx(math.sqrt(4100 / 300)) and (row.filter_mm, row.filter_anees) == (40.0, 2.0)
    assert (row.paper_calibration_s, row.paper_error_ppm) == (51, 30)


def test_a_case_that_is_seldom_declared_takes_for_ever():
    scores = [score(10, 40), score(20, 10, declared=False), score(30, 40, declared=False)]
    row = rows([Trial(CASE, i, s, "") for i, s in enumerate(scores)], {})[CASE]
    assert math.isinf(row.declare_s) and math.isinf(row.declare_moves)


def test_every_error_counts_over_its_own_bound():
    assert rms_ratio([10.0, 10.0], [10.0, 1e6]) == pytest.approx(math.sqrt(0.5))


def test_a_case_of_failures_alone_has_a_row_without_figures():
    row = rows([Trial(CASE, 0, None, "rain")], {})[CASE]
    assert isinstance(row, Row) and row.failed == 1 and math.isnan(row.median_mm) and math.isnan(row.covered)


def test_a_bound_that_is_not_finite_is_left_out():
    row = rows([Trial(CASE, i, score(10, 40, bound=b), "") for i, b in enumerate([5.0, math.inf])], {})[CASE]
    assert row.over_bound == 2.0


def test_a_declaration_is_false_from_the_given_distance_on(in_memory):
    document = json.loads(json.dumps(in_memory))
    document["calibrated"] |= {"source_error_m": 0.05, "found": True}
    assert scored(CASE, 0, document, "", 49.0).score.false and not scored(CASE, 0, document, "", 51.0).score.false
    document["calibrated"] |= {"found": False}
    assert not scored(CASE, 0, document, "", 49.0).score.false


def test_a_search_without_a_belief_has_failed(in_memory):
    document = {**in_memory, "calibrated": {**in_memory["calibrated"], "source_error_m": None}}
    assert scored(CASE, 0, document, "", 50.0).reason.startswith("the search ended before its first belief map")
    with pytest.raises(BadInput):
        read("accuracy", ["=3"])
