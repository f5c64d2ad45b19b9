"""Alternative worlds as they are configured, and that a map finds the one that its readings were drawn from."""

from dataclasses import replace

import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.gas.source_shape import CORNER, LINE, RING, TWO, WALL
from oio.inference import belief_map
from oio.inference.alternative_starts import _two_strengths
from oio.inference.alternatives import WORLDS, extend, of_shape
from oio.inference.law_extension import LawExtension
from oio.inference.map_fit import CALIBRATED, solve

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def maps(built):
    return built("belief_map")


def known_and_problem(made):
    theta = made.theta()
    return theta, made.problem(theta, poses=24)


def test_every_world_is_in_the_defaults_and_made(lab, maps):
    made = lab(3, 1, seed=90)
    theta, problem = known_and_problem(made)
    best = solve(problem, theta, made.model.fluctuation)
    assert set(maps.alternatives.worlds) == set(WORLDS)
    for name, make in maps.alternatives.of(problem, best):
        alternative = make({})
        assert alternative.name == name and alternative.starts
        for start in alternative.starts:
            assert start.shape == (alternative.problem.layout.size,) and np.all(np.isfinite(start))
        np.linalg.cholesky(alternative.problem.cov)  # a proper prior


def test_sources_that_no_reading_feels_have_the_least_strengths():
    """In a room of metres a start may lie where the field of either source is zero at every reading."""
    z, weight = np.array([1.0, -2.0]), np.array([1.0, 0.5])
    factors, cost = _two_strengths(np.zeros(2), np.zeros(2), z, weight)
    assert factors.tolist() == [1e-3, 1e-3] and cost == 3.0


def test_an_unknown_world_is_refused(maps):
    with pytest.raises(BadInput, match="has 'moon', but it can be wind, wind_changes"):
        replace(maps.alternatives, worlds=("moon",))


def test_readings_of_the_calibrated_world_are_explained_by_it(lab, maps):
    made = lab(3, 1, seed=91)
    theta, problem = known_and_problem(made)
    best, *others = maps.locate(problem.sniffs, made.known)
    assert best.world == CALIBRATED and not others
    assert np.linalg.norm(best.source - theta[:3]) < 0.03


def test_another_wind_is_found(lab, maps):
    """The wind of calibration is known to 0.5 / m; the readings were drawn with 30 / m."""
    made = lab(3, 1, seed=92)
    theta = made.theta()
    theta[5:8] = [30.0, 0.0, 0.0]
    problem = made.problem(theta, poses=24)
    taken_at_its_word = replace(maps, alternatives=maps.alternatives.none).locate(problem.sniffs, made.known)[0]
    best = maps.locate(problem.sniffs, made.known)[0]
    assert "wind" in best.world and best.minus_2_log_evidence < taken_at_its_word.minus_2_log_evidence - 20.0
    assert np.linalg.norm(best.source - theta[:3]) < min(0.03, np.linalg.norm(taken_at_its_word.source - theta[:3]))


def test_a_second_source_is_found_and_the_stronger_is_the_answer(lab, maps):
    made = lab(3, 1, seed=93)
    theta = made.theta()
    problem = made.problem(theta, poses=60)
    n, place = made.layout.size, np.array([0.30, -0.12, 0.15]) if theta[1] > 0 else np.array([0.30, 0.12, 0.15])
    extended = extend(problem, LawExtension(TWO), [(range(4), np.eye(4))])
    more = extended.expect(np.concatenate([theta, place, [-0.7]])) - problem.expect(theta)
    both = replace(problem.sniffs, ppm=problem.sniffs.ppm + more)
    best = maps.locate(both, made.known)[0]
    assert best.world in ("a second source", "a wall")
    assert np.linalg.norm(best.source - theta[:3]) < 0.03
    if best.world == "a second source":
        assert np.linalg.norm(best.mean[n : n + 3] - place) < 0.06


@pytest.mark.parametrize(
    ("kind", "half", "name"),
    [(LINE, (0.0, 0.0, 0.06), "line"), (RING, (0.0, 0.0, 0.04), "ring"), (RING, (0.0, 0.06, 0.0), "ring")],
)
@pytest.mark.parametrize("seed", [95, pytest.param(96, marks=pytest.mark.slow)])
def test_an_extended_source_is_found_with_its_shape(lab, maps, draw, kind, half, name, seed):
    made = lab(5, 1, seed=seed)
    theta = made.theta()
    problem = made.problem(theta, poses=60, quiet=True)
    extension = LawExtension(kind)
    extended = extend(problem, extension, [(extension.shape, 1e-2 * np.eye(3))])
    expected = extended.predict(np.concatenate([theta, half]))
    noise = draw(expected.along, made.model.fluctuation, np.random.default_rng(seed))[0]
    sniffs = replace(problem.sniffs, ppm=expected.ppm + theta[made.layout.baseline][0] + noise)
    best = maps.locate(sniffs, made.known)[0]
    assert best.world == WORLDS[name]
    assert np.linalg.norm(best.source - theta[:3]) < 0.02
    found = best.mean[made.layout.size :]
    assert min(np.linalg.norm(found - half), np.linalg.norm(found + half)) < 0.025


@pytest.mark.parametrize(
    ("kind", "feet", "names"),
    [(WALL, (0.03, 0.0, 0.0), ("wall",)), (CORNER, (0.05, 0.0, 0.0, 0.0, 0.05, 0.0), ("corner", "wall"))],  # or the nearer one of it
)
@pytest.mark.parametrize("seed", [104, pytest.param(106, marks=pytest.mark.slow)])
def test_walls_are_found_where_they_stand(lab, maps, draw, kind, feet, names, seed):
    made = lab(5, 1, seed=seed)
    theta = made.theta()
    problem = made.problem(theta, poses=80, quiet=True)
    expected = of_shape(problem, kind, np.eye(len(feet))).predict(np.concatenate([theta, feet]))
    noise = draw(expected.along, made.model.fluctuation, np.random.default_rng(seed))[0]
    sniffs = replace(problem.sniffs, ppm=expected.ppm + theta[made.layout.baseline][0] + noise)
    best = maps.locate(sniffs, made.known)[0]
    assert best.world in [WORLDS[name] for name in names]
    assert np.linalg.norm(best.source - theta[:3]) < 0.03


def test_another_lag_is_found(lab, maps):
    made = lab(3, 1, seed=96)
    theta = made.theta()
    theta[made.layout.tau] = np.log(2.5)
    sniffs = made.problem(theta, poses=30).sniffs
    taken_at_its_word = maps.as_calibrated.locate(sniffs, made.known)[0]
    best = maps.locate(sniffs, made.known)[0]
    assert best.world == WORLDS["lag"]
    assert best.mean[made.layout.tau] == pytest.approx(np.log(2.5), abs=0.2)
    assert np.linalg.norm(best.source - theta[:3]) < max(0.02, np.linalg.norm(taken_at_its_word.source - theta[:3]))


@pytest.mark.parametrize("seed", [97, 98, 99])
def test_joints_that_drift_otherwise_are_found(lab, maps, draw, seed):
    """Encoders that drift by 40 degrees during the search, from its first reading on, which is five times the arm's bound."""
    made = lab(5, 1, seed=seed)
    theta = made.theta()
    problem = made.problem(theta, poses=60, quiet=True)
    since_s, noise = problem.sniffs.t_s - problem.sniffs.t_s[0], made.model.fluctuation
    drift = np.full(5, np.radians(40.0)) / (0.5 * since_s[-1] ** 2)
    expected = problem.predict(theta)
    ppm = expected.ppm + theta[made.layout.baseline][0] + draw(expected.along, noise, np.random.default_rng(seed))[0]
    sniffs = replace(problem.sniffs, q=problem.sniffs.q + 0.5 * since_s[:, None] ** 2 * drift, ppm=ppm)
    arm = replace(made.arm, encoder_drift_deg_s2=float(np.degrees(drift[0])) / 5.0)
    known = replace(made.known, model=replace(made.model, arm=arm))
    taken_at_its_word, best = maps.as_calibrated.locate(sniffs, known)[0], maps.locate(sniffs, known)[0]
    assert best.world == WORLDS["joints"]
    assert np.linalg.norm(best.source - theta[:3]) < 0.7 * np.linalg.norm(taken_at_its_word.source - theta[:3])


def test_a_map_that_is_not_thorough_keeps_to_the_worlds_it_knows(lab, maps, monkeypatch):
    made = lab(3, 1, seed=94)
    _, problem = known_and_problem(made)
    seen = []
    fit_alternatives = belief_map.fit_alternatives
    monkeypatch.setattr(belief_map, "fit_alternatives", lambda *a: seen.append(a[-1]) or fit_alternatives(*a))
    first = maps.locate(problem.sniffs, made.known)
    maps.locate(problem.sniffs, made.known, first, False)
    assert seen == [None, {fit.world for fit in first}]
    assert maps.as_calibrated.locate(problem.sniffs, made.known)[0].world == CALIBRATED and len(seen) == 2
