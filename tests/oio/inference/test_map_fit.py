"""The fit's Jacobian, its honesty on data of its own model, and its symmetries."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2

from oio.gas.range_law import LAW
from oio.gas.whitening import whiten
from oio.inference.forward_model import Problem
from oio.inference.map_fit import discrepancy_m, solve


def moved(problem, theta, j, h):
    step = np.zeros_like(theta)
    step[j] = h
    return problem.predict(theta + step).ppm


def silent_start(problem):
    """The same with a first reading below the baseline: the lag then begins at nothing, whatever theta is."""
    ppm = np.array(problem.sniffs.ppm)
    ppm[0] = -100.0
    return replace(problem, sniffs=replace(problem.sniffs, ppm=ppm))


def names(layout):
    joints = [f"{what} {i}" for what in ("offset", "drift") for i in range(layout.dof)]
    rest = [f"gain {e}" for e in range(layout.elements)]
    return ["sx", "sy", "sz", "l", "n", "kx", "ky", "kz", "u", *joints, *rest, "tau", *(f"b {e}" for e in range(layout.elements))]


@pytest.mark.parametrize(("dof", "elements"), [(1, 1), (3, 2), (5, 2)])
def test_rows_are_central_differences(lab, dof, elements):
    made = lab(dof, elements, seed=dof)
    theta = made.theta()
    problem = silent_start(made.problem(theta))
    rows, offset = problem.predict(theta).rows, np.eye(elements)[problem.sniffs.element]
    for j, name in enumerate(names(made.layout)):
        h = 1e-7 if name.startswith("drift") else 1e-6
        numeric = (moved(problem, theta, j, h) - moved(problem, theta, j, -h)) / (2 * h)
        if name.startswith("b "):
            numeric = numeric + offset[:, j - made.layout.baseline.start]  # `ppm` is without offsets, the rows are with them
        atol = 1e-5 * max(np.max(np.abs(numeric)), 1e-3)
        np.testing.assert_allclose(rows[:, j], numeric, atol=atol, err_msg=name)


def test_rows_know_where_the_lag_begins(lab):
    made = lab(3, 1, seed=2)
    theta = made.theta()
    problem = made.problem(theta)
    j = made.layout.baseline.start
    numeric = (moved(problem, theta, j, 1e-6) - moved(problem, theta, j, -1e-6)) / 2e-6 + 1.0
    np.testing.assert_allclose(problem.predict(theta).rows[:, j], numeric, atol=1e-3)


def test_without_noise_the_fit_is_the_truth(lab):
    made = lab(3, 2, seed=5)
    theta = made.theta()
    problem = made.problem(theta, quiet=True)
    exact = replace(problem, mean=theta, cov=made.cov)
    fit = solve(
        exact, theta + 0.1 * np.sqrt(np.diag(made.cov)) * np.random.default_rng(0).standard_normal(len(theta)), made.model.fluctuation
    )
    np.testing.assert_allclose(fit.mean[:3], theta[:3], atol=1e-3)


def test_on_data_of_its_own_the_fit_is_honest(lab):
    """20 truths: the source within 3 sigma, and its mean NEES in a wide chi-square band (99.8 %).

    Its plume is that of the law: what a plume that strays adds to the covariance is nothing then.
    """
    values, misses = [], []
    for seed in range(20):
        made = lab(3, 1, seed=100 + seed)
        made.law = replace(made.law, model_discrepancy=0.0)
        theta = made.theta()
        fit = solve(made.problem(theta, poses=10), theta, made.model.fluctuation)
        error = fit.mean[:3] - theta[:3]
        values.append(error @ np.linalg.solve(fit.cov[:3, :3], error))
        misses.append(np.max(np.abs(error) / np.sqrt(np.diag(fit.cov)[:3])))
    assert np.mean(np.array(misses) < 3.0) >= 0.95
    low, high = chi2.ppf([1e-3, 1 - 1e-3], 60) / 20
    assert low < np.mean(values) < high, np.mean(values)


def test_the_covariance_is_between_the_bound_of_no_data_and_none(lab):
    made = lab(3, 1, seed=7)
    theta = made.theta()
    fit = solve(made.problem(theta), theta, made.model.fluctuation)
    assert np.all(np.linalg.eigvalsh(fit.cov / np.sqrt(np.outer(np.diag(fit.cov), np.diag(fit.cov)))) > 0)
    assert np.all(np.diag(fit.cov) <= np.diag(made.cov) * (1 + 1e-9))  # readings never widen the prior
    assert np.trace(fit.cov[:3, :3]) < 0.1 * np.trace(made.cov[:3, :3])


def test_more_readings_tell_more(lab):
    made = lab(3, 1, seed=8)
    theta = made.theta()
    problem = made.problem(theta, poses=12)
    half = replace(problem, sniffs=problem.sniffs.between(0.0, 12.0))
    whole, part = (solve(p, theta, made.model.fluctuation).cov for p in (problem, half))
    assert np.trace(whole[:3, :3]) < np.trace(part[:3, :3])


def test_ppm_or_ppb_find_the_same_source(lab):
    made = lab(3, 2, seed=9)
    theta = made.theta()
    problem, lay = made.problem(theta), made.layout
    scale = np.ones(lay.size)
    scale[lay.baseline] = 1e3
    mean = problem.mean * scale
    mean[lay.strength] += np.log(1e3)
    sn = problem.sniffs
    in_ppb = replace(
        problem, sniffs=replace(sn, ppm=1e3 * sn.ppm, sigma_ppm=1e3 * sn.sigma_ppm), mean=mean, cov=problem.cov * np.outer(scale, scale)
    )
    start = theta * scale
    start[lay.strength] += np.log(1e3)
    here, there = (solve(p, x, made.model.fluctuation) for p, x in ((problem, theta), (in_ppb, start)))
    np.testing.assert_allclose(there.mean[:3], here.mean[:3], atol=1e-7)
    np.testing.assert_allclose(there.cov[:3, :3], here.cov[:3, :3], rtol=1e-5)


def turned(problem, arm, angle):
    """The same world turned about the shoulder's axis by what an azimuth of `angle` does: source, wind, prior and path with it."""
    at = arm.nose(np.array([[0.0, *arm.home[1:]], [angle, *arm.home[1:]]])) - arm.shoulder
    by = np.arctan2(at[1, 1], at[1, 0]) - np.arctan2(at[0, 1], at[0, 0])
    turn = np.array([[np.cos(by), -np.sin(by), 0.0], [np.sin(by), np.cos(by), 0.0], [0.0, 0.0, 1.0]])
    whole = np.eye(len(problem.mean))
    whole[:3, :3] = whole[5:8, 5:8] = turn
    shift = np.zeros(len(problem.mean))
    shift[:3] = arm.shoulder - turn @ arm.shoulder
    q = np.array(problem.sniffs.q)
    q[:, 0] += angle
    there = Problem(
        replace(problem.sniffs, q=q), problem.arm, problem.law, problem.elements, problem.rise_s, problem.fall_s,
        whole @ problem.mean + shift, whole @ problem.cov @ whole.T,
    )  # fmt: skip
    return there, whole, shift


@pytest.mark.parametrize("angle", [-1.0, 0.4])
def test_turning_the_world_turns_the_answer(lab, angle):
    made = lab(3, 1, seed=10)
    theta = made.theta()
    here = made.problem(theta)
    there, turn, shift = turned(here, made.arm, angle)
    one, other = solve(here, theta, made.model.fluctuation), solve(there, turn @ theta + shift, made.model.fluctuation)
    spread = np.sqrt(np.diag(other.cov))
    assert np.max(np.abs(turn @ one.mean + shift - other.mean) / spread) < 0.05  # the fit ends within 0.01 of its own spread
    difference = (turn @ one.cov @ turn.T - other.cov) / np.outer(spread, spread)
    assert np.max(np.abs(difference[:LAW, :LAW])) < 0.02


def told(lab, model_discrepancy):
    """A problem whose law strays by so much, its truth, and what `discrepancy_m` wants besides."""
    made = lab(3, 1, seed=13)
    theta = made.theta()
    problem = replace(made.problem(theta), law=replace(made.law, model_discrepancy=model_discrepancy))
    expected = problem.predict(theta)
    rows = expected.rows[:, :3] / np.sqrt(expected.along.variance_ppm2)[:, None]
    return problem, theta, rows, expected.along


def afar(along, factor):
    return replace(along, field=replace(along.field, r_m=factor * along.field.r_m))


@given(model_discrepancy=st.floats(1e-3, 1.0), more=st.floats(1.01, 5.0), away=st.floats(1.01, 5.0))
def test_a_plume_that_strays_displaces_by_its_straying_and_the_distance(lab, model_discrepancy, more, away):
    """d r = r d(ln c) / n: in proportion to both, and the less the steeper the law."""
    problem, theta, rows, along = told(lab, model_discrepancy)
    here = discrepancy_m(problem, theta, rows, along)
    there = replace(problem, law=replace(problem.law, model_discrepancy=more * model_discrepancy))
    assert discrepancy_m(there, theta, rows, along) == pytest.approx(more * here)
    assert discrepancy_m(problem, theta, rows, afar(along, away)) == pytest.approx(away * here)
    steep = np.array(theta)
    steep[problem.layout.exponent] *= away
    assert discrepancy_m(problem, steep, rows, along) == pytest.approx(here / away)


def test_a_plume_of_the_law_displaces_nothing(lab):
    problem, theta, rows, along = told(lab, 0.0)
    assert discrepancy_m(problem, theta, rows, along) == 0.0
    assert np.all(np.isfinite(discrepancy_m(problem, theta, np.zeros_like(rows), along)))  # nothing was smelt


def test_the_distance_is_that_of_the_readings_that_tell(lab):
    problem, theta, rows, along = told(lab, 0.2)
    r_m = along.field.r_m[along.at]
    alone = np.zeros_like(rows)
    alone[7] = rows[7]
    assert discrepancy_m(problem, theta, alone, along) == pytest.approx(0.2 * r_m[7] / theta[problem.layout.exponent])
    assert 0.2 * r_m.min() <= theta[problem.layout.exponent] * discrepancy_m(problem, theta, rows, along) <= 0.2 * r_m.max()


def test_straying_is_a_length_in_any_unit(lab):
    """Metres to millimetres: distances a thousand times, what a reading tells of a place a thousandth."""
    problem, theta, rows, along = told(lab, 0.2)
    in_mm = discrepancy_m(problem, theta, rows / 1e3, afar(along, 1e3))
    assert in_mm == pytest.approx(1e3 * discrepancy_m(problem, theta, rows, along), rel=1e-12)


def test_more_sniffs_do_not_average_straying(lab):
    """The readings alone tell the source better than the plume strays; the covariance does not."""
    made = lab(3, 1, seed=14)
    theta, calm = made.theta(), replace(made.model.fluctuation, gamma=1e-3)
    problem = replace(made.problem(theta, poses=10, stay_s=10.0, quiet=True), law=replace(made.law, model_discrepancy=0.3))
    fit = solve(problem, theta, calm)
    expected = problem.predict(fit.mean)
    rows = whiten(expected.rows, expected.along, calm).rows
    strays = discrepancy_m(problem, fit.mean, rows[:, :3], expected.along)
    alone = np.trace(np.linalg.inv(rows.T @ rows + np.linalg.inv(problem.cov))[:3, :3])
    assert alone < 0.5 * strays**2 and np.trace(fit.cov[:3, :3]) == pytest.approx(alone + strays**2, rel=1e-6)
