"""The belief map: hypotheses contain the truth, best first, apart; spheres have the radii of the law."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from oio.core.errors import BadInput
from oio.inference import belief_map as belief_map_module
from oio.inference.belief_map import search_problem
from oio.inference.map_fit import CALIBRATED, Fit, solve
from oio.inference.range_spheres import range_spheres
from oio.inference.source_strength import fit_strength, mirror_start, readings_without_source


def far(fit, source):
    error = fit.mean[:3] - source
    return error @ np.linalg.solve(fit.cov[:3, :3], error)


def test_the_hypotheses_contain_the_truth(lab, built):
    belief_map, inside = built("belief_map"), []
    for seed in range(8):
        made = lab(3, 1, seed=200 + seed)
        theta = made.theta()
        hypotheses = belief_map.locate(made.problem(theta, poses=8).sniffs, made.known)
        inside.append(min(far(fit, theta[:3]) for fit in hypotheses) < chi2.ppf(0.999, 3))
    assert sum(inside) >= 7


def narrow(lab, dof, seed):
    """Six sniffs of a source, and where a fit that begins at the truth ends."""
    made = lab(dof, 1, seed=seed)
    theta = np.array(made.mean)
    theta[:3], theta[3] = made.rng.uniform([0.22, -0.2, 0.1], [0.42, 0.2, 0.28]), np.log(20.0)
    sniffs = made.problem(theta, poses=6).sniffs
    return made, sniffs, solve(search_problem(sniffs, made.known), theta, made.model.fluctuation)


def finds(belief_map, made, sniffs, best):
    """Whether a hypothesis is the minimum at the truth."""
    return any(np.linalg.norm(fit.mean[:3] - best.mean[:3]) < 0.02 for fit in belief_map.locate(sniffs, made.known))


def as_it_is(problem, theta, gamma):
    return theta


def nowhere(problem, nose_m):
    """Differenced spheres that do not meet."""
    return np.empty((0, 3))


MISSED = [(3, 3), (3, 24), (5, 4), (5, 44)]  # dof and seeds whose minimum coarse places miss


@pytest.mark.parametrize(("dof", "seed"), MISSED)
def test_shells_find_what_coarse_places_miss(lab, built, monkeypatch, dof, seed):
    monkeypatch.setattr(belief_map_module, "linear_source", nowhere)
    made, sniffs, best = narrow(lab, dof, seed)
    belief_map = built("belief_map").as_calibrated
    assert not finds(replace(belief_map, points_per_shell=0), made, sniffs, best) and finds(belief_map, made, sniffs, best)


def test_differenced_spheres_find_what_coarse_places_miss(lab, built):
    """More often than not: the linear solution is biased."""
    grid_points = replace(built("belief_map"), points_per_shell=0)
    assert 2 * sum(finds(grid_points, *narrow(lab, dof, seed)) for dof, seed in MISSED) > len(MISSED)


def out_of_reach(fit):
    """The fit with its source metres away, and likelier by far."""
    return replace(fit, mean=np.concatenate([[9.0, -9.0, 9.0], fit.mean[3:]]), chi2=fit.chi2 - 1e3, minus_2_log_evidence=-1e9)


def test_a_fit_out_of_reach_is_no_answer_while_there_is_another(lab, built, monkeypatch):
    """A background that drifts looks like a strong source a metre away; before, it was believed, and the search went there."""
    made, sniffs, best = narrow(lab, 3, 3)
    near = [solve(search_problem(sniffs, made.known), best.mean, made.model.fluctuation)]
    monkeypatch.setattr(belief_map_module, "solve", lambda *given: near.pop() if near else out_of_reach(solve(*given)))
    found = built("belief_map").as_calibrated.locate(sniffs, made.known)
    assert len(found) == 1 and found[0].source == pytest.approx(best.source, abs=1e-3)


def test_where_every_calibrated_fit_is_out_of_reach_another_world_answers(lab, built, monkeypatch):
    made, sniffs, _ = narrow(lab, 3, 3)
    monkeypatch.setattr(belief_map_module, "solve", lambda *given: out_of_reach(solve(*given)))
    belief_map = built("belief_map")
    assert all(fit.source[0] == 9.0 for fit in belief_map.as_calibrated.locate(sniffs, made.known))  # there is none
    found = belief_map.locate(sniffs, made.known)
    assert all(fit.world != CALIBRATED and np.all(np.abs(fit.source) < 1.0) for fit in found)


def test_a_linear_start_out_of_the_box_is_brought_into_it(lab, built, monkeypatch):
    monkeypatch.setattr(belief_map_module, "linear_source", lambda problem, nose_m: np.array([[9.0, -9.0, 9.0]]))
    made, sniffs, best = narrow(lab, 3, 3)
    assert finds(built("belief_map"), made, sniffs, best)


def test_the_mirror_point_is_tried(lab, built, monkeypatch):
    """Coarse places alone leave the wrong side of the plane only, at a chi-square 22 worse."""
    monkeypatch.setattr(belief_map_module, "linear_source", nowhere)
    made, sniffs, best = narrow(lab, 5, 96)
    grid_points = replace(built("belief_map").as_calibrated, points_per_shell=0)
    assert finds(grid_points, made, sniffs, best)
    monkeypatch.setattr(belief_map_module, "mirror_start", as_it_is)
    (wrong,) = grid_points.locate(sniffs, made.known)
    assert wrong.chi2 > best.chi2 + 20.0 and not finds(grid_points, made, sniffs, best)
    problem, noise = search_problem(sniffs, made.known), made.model.fluctuation
    right = solve(problem, mirror_start(problem, wrong.mean, noise.gamma), noise)
    assert np.linalg.norm(right.mean[:3] - best.mean[:3]) < 0.02


def test_a_mirror_point_smells_alike_from_the_plane_and_has_the_source_for_its_own(lab):
    """One joint, still air."""
    made = lab(1, 1, seed=7)
    theta = made.theta()
    theta[5:8] = 0.0
    problem = search_problem(made.problem(theta, quiet=True).sniffs, made.known)
    there = mirror_start(problem, theta, 0.3)
    assert abs(there[2] - theta[2]) > 0.02
    np.testing.assert_allclose(there[:2], theta[:2], atol=1e-9)
    np.testing.assert_allclose(problem.expect(there), problem.expect(theta), rtol=0.02)
    np.testing.assert_allclose(mirror_start(problem, there, 0.3)[:3], theta[:3], atol=1e-9)


@pytest.mark.parametrize("none", [{"points_per_shell": 0}, {"shells_m": ()}, {"restarts": 0}])
def test_no_shells_and_no_restarts_are_allowed(lab, built, none):
    made, sniffs, _ = narrow(lab, 3, 3)
    belief_map = replace(built("belief_map"), **none)
    first = belief_map.locate(sniffs, made.known)
    assert belief_map.locate(sniffs, made.known, first)[0].chi2 <= first[0].chi2 + 0.1


def test_no_map_without_a_start(built):
    with pytest.raises(BadInput, match="starts is 0"):
        replace(built("belief_map"), starts=0)


def test_hypotheses_are_best_first_and_apart(lab, built):
    made, belief_map = lab(2, 1, seed=3), built("belief_map")
    theta = made.theta()
    hypotheses = belief_map.locate(made.problem(theta, poses=6).sniffs, made.known)
    costs = [fit.chi2 for fit in hypotheses]
    assert costs == sorted(costs) and costs[-1] <= costs[0] + belief_map.keep_chi2
    for i, fit in enumerate(hypotheses):
        assert all(np.linalg.norm(fit.mean[:3] - other.mean[:3]) > belief_map.min_separation_m / 2 for other in hypotheses[:i])


def test_one_joint_does_not_pretend_to_a_place(lab, built):
    """An arc leaves a curve of sources: the region must stay large."""
    made = lab(1, 1, seed=4)
    theta = made.theta()
    hypotheses = built("belief_map").locate(made.problem(theta, poses=8).sniffs, made.known)
    assert np.sqrt(np.trace(hypotheses[0].cov[:3, :3])) > 0.02 or len(hypotheses) > 1


def test_strength_is_that_of_least_squares(lab):
    made = lab(3, 1, seed=5)
    theta = made.theta()
    problem = search_problem(made.problem(theta, quiet=True).sniffs, made.known)
    start = np.array(theta)
    start[3] = 0.0
    left = readings_without_source(problem, start)
    cost, found = fit_strength(problem, start, 0.3, left)
    assert found[3] == pytest.approx(theta[3], abs=0.05)  # rise and fall hold at other times while the strength is wrong
    np.testing.assert_array_equal(np.delete(found, 3), np.delete(theta, 3))
    elsewhere = start + np.array([0.1, 0.0, 0.0, *[0.0] * (len(start) - 3)])
    assert 10 * cost < fit_strength(problem, elsewhere, 0.3, left)[0]


def test_spheres_have_the_radii_of_the_law(lab):
    """Readings without noise at five places, long after the lag: the ranges are the distances."""
    made = lab(3, 1, seed=6)
    theta = np.array(made.mean)
    theta[:4] = 0.33, 0.05, 0.18, np.log(20.0)
    theta[4] = 1.3
    problem = made.problem(theta, poses=5, stay_s=9.0, quiet=True)
    fit = Fit(made.layout, theta, made.cov, 0.0, 0.0, made.model.fluctuation, len(problem.sniffs.ppm), made.law)
    centres, radii = range_spheres(problem.sniffs, fit, made.arm, made.law, 5)
    distance = np.linalg.norm(centres - theta[:3], axis=1)
    assert len(radii) == 5 and np.ptp(distance) > 0.03
    np.testing.assert_allclose(radii, np.hypot(distance, made.law.radius_m), rtol=0.01)


@pytest.mark.parametrize("u", [0.1, 0.001])
def test_a_strength_that_was_told_is_begun_with_and_kept(lab, built, u):
    """However well it is told: what is found is no worse than what a fit finds that begins at the truth."""
    for seed in (306, 307, 311):
        made = lab(5, 1, seed=seed)
        theta = made.theta()
        made.law = replace(made.law, ln_strength=float(theta[3]), ln_strength_u=u)
        made.model = replace(made.model, law=made.law)
        sniffs = made.problem(theta, poses=4).sniffs
        best = built("belief_map").locate(sniffs, made.known)[0]
        assert best.chi2 < solve(search_problem(sniffs, made.known), theta, made.model.fluctuation).chi2 + 0.1
        assert abs(best.mean[3] - theta[3]) < 4.0 * u
