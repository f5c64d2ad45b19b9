"""How long the repeats on the known source go on: at least so many, and more while the calibration ends within its budget."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from hydra.utils import instantiate

from oio.bench.trial import experiment
from oio.core.folders import CONF
from oio.core.records import seconds
from oio.log import MemoryLog
from oio.results.calibration import BaselineResult, MapCalibration
from oio.runtime.runner import run_stages
from pipelines.map_beliefs import MapBeliefs

pytestmark = pytest.mark.long

STANDARD = instantiate(yaml.safe_load((CONF / "verdict" / "standard.yaml").read_text(encoding="utf-8")), _convert_="all")
WORDS = (
    "sensor=ndir", "air=steady", "dof=3", "stage=[warm_up,baseline,calibrate_bouts,map_beliefs]", "stage.calibrate_bouts.moves_per_rung=1",
    "stage.map_beliefs.repeats=2",
)  # fmt: skip
MEASUREMENTS = 5


def calibrated(out, budget_s, seed, *words):
    """The map, and how long calibration took."""
    built = experiment((*WORDS, f"stage.map_beliefs.budget_s={budget_s}", *words), seed)
    with built.backend.open() as world:
        results = run_stages(built.stages, world, built.arm, MemoryLog(), out, seed)
    found = results[MapCalibration]
    return found, seconds(found.ended_ns - results[BaselineResult].began_ns)


@pytest.fixture(scope="module", params=[0, 1, 2])
def least(request, tmp_path_factory):
    """No budget at all: the fewest repeats."""
    return request.param, *calibrated(tmp_path_factory.mktemp("least"), 0.0, request.param)


def test_never_fewer_repeats_than_asked_for(least):
    _, found, _ = least
    assert (len(found.repeats), found.moves) == (2, 2 * MEASUREMENTS)


def words_of(found):
    """What the criteria of steps and bouts say of a map."""
    criteria = {name: STANDARD.criteria[name] for name in ("steps", "bout_detection")}
    return {name: criterion.judge(name, {MapCalibration: found}) for name, criterion in criteria.items()}


def test_an_open_valve_is_seen_in_rise_and_fall_and_in_bouts(least):
    _, found, _ = least
    judged = words_of(found)
    assert [j.word for j in judged.values()] == ["PASS", "PASS"], judged
    assert found.exposures.approaches.trials == 2 and (found.exposures.near.trials, found.exposures.away.trials) == (8, 2)
    assert found.highest_ppm[0] > 100.0
    assert found.guard.load_unwatched == () and 0.2 < found.guard.top_speed_m_s < found.guard.speed_limit_m_s


def test_a_closed_valve_fails(tmp_path):
    found, _ = calibrated(tmp_path, 0.0, 0, "beacon.strength=1e-6")
    judged = words_of(found)
    assert [j.word for j in judged.values()] == ["FAIL", "FAIL"], judged
    assert "its valve is closed" in judged["steps"].action


def test_more_repeats_end_within_the_budget(least, tmp_path):
    seed, fewest, took_s = least
    found, time_s = calibrated(tmp_path, took_s + 16.0, seed)
    assert took_s < time_s <= took_s + 16.0
    assert len(found.repeats) > 2 and found.fit.readings > fewest.fit.readings


def test_a_repeat_that_lasts_longer_than_thought_is_broken_off(least, tmp_path, monkeypatch):
    """A measurement that would end too late is not begun; those before it are moves and readings, but no repeat."""
    monkeypatch.setattr(MapBeliefs, "_fits", lambda *_: True)
    seed, fewest, took_s = least
    found, time_s = calibrated(tmp_path, took_s + 4.0, seed)
    assert took_s < time_s <= took_s + 4.0
    assert len(found.repeats) == 2 and 0 < found.moves - fewest.moves < MEASUREMENTS
    assert found.fit.readings > fewest.fit.readings


def test_a_pose_that_the_arm_cannot_swing_to_is_passed_over(monkeypatch):
    """Folded backwards the nose is at the front too, but on the way there it is not."""
    built = experiment(WORDS, 0)
    stage, arm, folded = built.stages["map_beliefs"], built.arm, np.array([1.783, -1.518, -1.527])
    near = arm.solve_ik(np.array([0.33, 0.0, 0.2]), arm.home)
    reached = iter([folded, None, near])
    monkeypatch.setattr(type(arm), "solve_ik", lambda *_: next(reached))
    context = SimpleNamespace(world=SimpleNamespace(goal=arm.home), rng=np.random.default_rng(0))
    assert arm.is_allowed(folded)
    np.testing.assert_array_equal(stage._pose(context, 0.1), near)


def test_the_budget_is_the_papers_time(built, composed):
    for name, row in composed().table_1.items():
        assert built("stage", f"sensor={name}", "stage=[map_beliefs]")["map_beliefs"].budget_s == row.time_s


def test_what_was_told_of_the_source_is_nothing_to_the_beacon(tmp_path):
    """Neither the fit nor its repeats believe the strength of another source."""
    results = []
    for words in ((), ("range_law.ln_strength=1.0", "range_law.ln_strength_u=0.05")):
        built = experiment((*WORDS, "stage.map_beliefs.budget_s=0", *words), 0)
        with built.backend.open() as world:
            results.append(run_stages(built.stages, world, built.arm, MemoryLog(), tmp_path, 0)[MapCalibration])
    untold, told = results
    assert told.type_b == untold.type_b and told.fit.chi2 == untold.fit.chi2
    assert told.fit.mean.tobytes() == untold.fit.mean.tobytes() and told.fit.cov.tobytes() == untold.fit.cov.tobytes()
    assert told.fit.law == replace(untold.fit.law, ln_strength=1.0, ln_strength_u=0.05)


@pytest.mark.parametrize("resolved_by", [1, 3, None])
def test_a_repeat_goes_on_until_one_place_is_left_and_is_never_judged_by_the_nearest(tmp_path, monkeypatch, resolved_by):
    """Two places, the better one wrong and the other at the beacon itself: the better one is the answer, and its covariance names both."""
    found, _ = calibrated(tmp_path, 0.0, 0)
    beacon = np.array(experiment(WORDS, 0).stages["map_beliefs"].beacon.position)
    wrong = replace(found.fit, mean=np.concatenate([beacon + np.array([0.1, 0.0, 0.0]), found.fit.mean[3:]]), minus_2_log_evidence=0.0)
    right = replace(wrong, mean=np.concatenate([beacon, found.fit.mean[3:]]), minus_2_log_evidence=0.5)
    calls = []

    def locate(_, sniffs, known, *args):
        calls.append(len(sniffs.ppm))
        return (wrong,) if len(calls) == resolved_by else (wrong, right)

    monkeypatch.setattr(type(experiment(WORDS, 0).stages["map_beliefs"].belief_map), "locate", locate)
    first = calibrated(tmp_path, 0.0, 0)[0].repeats[0]
    most = 2 * MEASUREMENTS - 1
    assert first.moves == (most if resolved_by is None else MEASUREMENTS - 1 + resolved_by - 1)
    assert first.miss_m == pytest.approx(0.1)
    share = 0.0 if resolved_by else 1 / (1 + np.exp(0.25))
    assert first.refined_cov_m2[0, 0] == pytest.approx(wrong.source_cov[0, 0] + share * 0.1**2, rel=1e-6)
    assert calls[: first.moves - MEASUREMENTS + 2] == sorted(calls[: first.moves - MEASUREMENTS + 2])
