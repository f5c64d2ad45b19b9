"""Drift and filters: the nose is scored at the instants at which it was believed, and every filter takes its course."""

import csv
import math

import numpy as np
import pytest

from oio.bench import __main__ as command
from oio.bench.drift_table import rows
from oio.bench.drift_trial import Case, Times, run_trial
from oio.bench.filter_workload import Step, first_belief, matrices, workload
from oio.bench.filters import timed
from oio.bench.nose_error import NoseErrorSample, NoseLog, errors, nose_error_at
from oio.bench.trial import composed_trial
from oio.core.records import JointState, Truth
from oio.estimators.ekf import Ekf

pytestmark = pytest.mark.long

CASE = Case("ndir", "steady", 3, "ekf", "known")
BRIEF = ("stage.map_beliefs.repeats=2", "stage.map_beliefs.budget_s=0", "stage.calibrate_bouts.moves_per_rung=2")
TIMES = Times((15.0, 20.0), 5.0, 0.5)


@pytest.fixture(scope="module")
def hovered():
    return run_trial((*CASE.words(20.0), *BRIEF), "known", 0, TIMES)


def test_a_known_source_keeps_the_nose(hovered):
    assert [at.after_s for at in hovered] == [15.0, 20.0]
    assert all(at.nose_mm < 20.0 and at.claimed_mm < 20.0 for at in hovered)


def test_the_same_seed_gives_the_same_drift(hovered):
    assert run_trial((*CASE.words(20.0), *BRIEF), "known", 0, TIMES) == hovered


def test_an_unknown_source_is_searched_for_all_the_time():
    at = run_trial((*CASE.words(40.0), *BRIEF), "unknown", 0, Times((40.0,), 10.0, 0.5))[-1]
    assert at.after_s == 40.0 and math.isfinite(at.nose_mm)


def test_noses_are_compared_at_their_own_instants(built):
    arm, log = built("arm", "dof=3"), NoseLog()
    q, up, aside = arm.home, np.array([0.0, 0.0, 0.004]), np.array([0.0, 0.003, 0.0])
    for t in (0, 1, 2):
        log.write(JointState(t, q, 0 * q, 0 * q))
        log.write(Truth(t, q, arm.nose(q) + aside, np.zeros(3), 0.0))
    log.odometry(1, arm.nose(q) + aside + up, 4e-6 * np.eye(3))
    log.odometry(9, arm.nose(q), np.eye(3))  # no truth then
    found = errors(log, arm, -1)
    assert found == pytest.approx(np.array([[2e-9, 0.004, 0.003, 12e-6, 4.0]]))
    at = nose_error_at(found, 1.0, 2.0)
    assert (at.nose_mm, at.dead_reckoning_mm, at.claimed_mm) == pytest.approx((4.0, 3.0, math.sqrt(12)))
    assert (at.after_s, at.inside_95) == (1.0, 1.0)
    assert nose_error_at(found, 9.0, 1.0) is None


def test_rows_are_medians_and_count_failures():
    trials = [(CASE, i, [NoseErrorSample(60.0, nose, 30.0, 4.0, 0.9)], "") for i, nose in enumerate([5.0, 9.0, 6.0])] + [
        (CASE, 3, [], "rain")
    ]
    (row,) = rows(trials, Times((60.0,), 20.0, 1.0))
    assert (row.trials, row.failed, row.nose_mm, row.worst_mm, row.dead_reckoning_mm, row.gain) == (4, 1, 6.0, 9.0, 30.0, 5.0)
    (nothing,) = rows(trials[3:], Times((60.0,), 20.0, 1.0))
    assert nothing.failed == 1 and math.isnan(nothing.nose_mm)


def test_the_command_leaves_tables_and_a_figure(tmp_path, capsys):
    out = tmp_path / "out"
    own = ["air=steady", "dof=3", "source=known", "after_s=15,20", "window_s=5", "dwell_s=0.5", "seeds=0", "jobs=1", f"out={out}"]
    assert command.main(["drift", *own, *BRIEF]) == 0
    table = list(csv.DictReader((out / "drift.csv").read_text(encoding="utf-8").splitlines()))
    assert [(row["source"], row["after_s"], row["failed"]) for row in table] == [("known", "15.0", "0"), ("known", "20.0", "0")]
    assert (out / "drift.png").read_bytes().startswith(b"\x89PNG") and (out / "trials.csv").is_file()
    assert "filter [mm]" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["drift", "source=lost"], "source is a list of known, unknown"),
        (["drift", "dof=2"], "a nose needs three joints"),
        (["drift", "sensor=xx"], "sensor=xx was given, but sensor can be"),
        (["filters", "dof=1"], "takes three or five joints"),
        (["filters", "ekf=xx"], "ekf=xx was given, but ekf can be"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_mistakes_are_refused_in_one_paragraph(words, said, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert command.main(words) == 2
    out, err = capsys.readouterr()
    assert said in err and err.count("\n") == 1 and out == ""
    assert not list(tmp_path.iterdir())


# ---- filters


@pytest.fixture(scope="module")
def way():
    return workload(composed_trial(("sensor=ec", "dof=5"))[1], 12)


def test_the_course_surprises_nobody(way):
    estimator = Ekf(gate_nis=25.0)
    belief = first_belief(estimator, way)
    for joints, reading in zip(way.joints, way.readings, strict=True):
        belief, innovation = estimator.update(way.model, estimator.predict(way.model, belief, joints), reading)
        assert innovation.residual[0] == pytest.approx(0.0, abs=1e-9) and not innovation.gated


def test_filterpy_gets_the_matrices_of_the_plain_filter(way):
    estimator, belief = Ekf(gate_nis=25.0), first_belief(Ekf(gate_nis=25.0), way)
    for step, joints, reading in zip(matrices(way), way.joints, way.readings, strict=True):
        assert isinstance(step, Step)
        assert belief.mean == pytest.approx(step.mean, rel=1e-9, abs=1e-12)
        belief, _ = estimator.update(way.model, estimator.predict(way.model, belief, joints), reading)


def test_every_filter_of_conf_is_timed(tmp_path, capsys):
    assert command.main(["filters", "steps=3", "repeats=1", f"out={tmp_path}"]) == 0
    table = list(csv.DictReader((tmp_path / "filters.csv").read_text(encoding="utf-8").splitlines()))
    assert {"ekf", "filterpy", "paper"} <= {row["ekf"] for row in table}
    assert all(float(row["step_us"]) > 0 and float(row["ratio"]) > 0 for row in table)
    assert "the table is in" in capsys.readouterr().out


def test_ratios_are_of_what_they_say(way):
    (row,) = timed({"ekf": Ekf(gate_nis=25.0)}, way, 1)
    assert row.ratio == row.step_us / row.filterpy_us and row.ratio_with_model == row.step_us / row.filterpy_with_model_us
