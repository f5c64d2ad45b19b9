"""No estimate beats the Cramer-Rao bound; more readings and less noise lower it."""

from dataclasses import replace

import numpy as np
import pytest

from oio.gas.fluctuation import Fluctuation
from oio.gas.whitening import whiten
from oio.inference.belief_map import search_problem
from oio.inference.bounds import at_truth, cramer_rao, cramer_rao_over_time, marginal_information, posterior_cramer_rao, van_trees
from oio.inference.map_fit import solve
from oio.inference.prior import Prior


def test_the_fit_does_not_beat_the_bound_and_comes_near_it(lab):
    ratios = []
    for seed in range(20):
        made = lab(3, 1, seed=300 + seed)
        theta = made.theta()
        sniffs = made.problem(theta, poses=12).sniffs
        fit = solve(search_problem(sniffs, made.known), theta, made.model.fluctuation)
        ratios.append(np.linalg.norm(fit.mean[:3] - theta[:3]) / cramer_rao(sniffs, made.known, theta).rms_m)
    efficiency = np.sqrt(np.mean(np.square(ratios)))
    assert 0.8 * 0.8 < efficiency < 2.0, efficiency  # 0.8, and the scatter of an RMS of 20
    assert efficiency == pytest.approx(1.0, abs=0.4)


def test_more_readings_and_calmer_air_lower_the_bound(lab):
    made = lab(3, 1, seed=1)
    theta = made.theta()
    sniffs = made.problem(theta, poses=12).sniffs
    whole, half = (cramer_rao(s, made.known, theta).rms_m for s in (sniffs, sniffs.between(0.0, 12.0)))
    assert 0 < whole < half
    calm = Prior(made.mean, made.cov, replace(made.model, fluctuation=Fluctuation(1.0, 0.02, 0.3)))
    assert cramer_rao(sniffs, calm, theta).rms_m < whole


def test_over_time_the_bound_falls_to_that_of_all_readings(lab):
    made = lab(3, 1, seed=1)
    theta = made.theta()
    sniffs = made.problem(theta, poses=12).sniffs
    t_s, rms_m = np.array(cramer_rao_over_time(sniffs, made.known, theta, 20)).T
    assert len(t_s) > 10 and np.all(np.diff(t_s) > 0) and np.all(np.diff(rms_m) <= 1e-12)
    assert t_s[-1] == sniffs.reading_t_s[-1]
    assert rms_m[-1] == pytest.approx(cramer_rao(sniffs, made.known, theta).rms_m, rel=1e-9)
    early = sniffs.between(0.0, t_s[5])
    assert rms_m[5] == pytest.approx(cramer_rao(early, made.known, theta).rms_m, rel=0.01)


def test_without_gas_the_bound_is_infinite(lab):
    made = lab(3, 1, seed=1)
    theta = made.theta()
    sniffs = made.problem(theta, poses=12).sniffs
    theta[3] = -800.0  # ln ppm: a source that emits nothing
    assert np.isinf(cramer_rao(sniffs, made.known, theta).rms_m)
    assert cramer_rao_over_time(sniffs, made.known, theta, 20) == ()


def test_knowing_the_nuisances_less_raises_the_bound(lab):
    made = lab(3, 1, seed=2)
    theta = made.theta()
    sniffs = made.problem(theta, poses=12).sniffs
    vague = Prior(made.mean, 4.0 * made.cov, made.model)
    assert cramer_rao(sniffs, vague, theta).rms_m > cramer_rao(sniffs, made.known, theta).rms_m


def test_the_bound_does_not_hang_on_what_was_believed_of_the_source(lab):
    made = lab(3, 1, seed=3)
    theta = made.theta()
    sniffs, cov = made.problem(theta, poses=12).sniffs, np.array(made.cov)
    cov[range(4), range(4)] *= 1e-2
    sure = Prior(made.mean, cov, made.model)
    assert cramer_rao(sniffs, sure, theta).rms_m == pytest.approx(cramer_rao(sniffs, made.known, theta).rms_m, rel=1e-6)


def test_at_truth_keeps_the_place_and_finds_the_strength(lab):
    made = lab(3, 1, seed=4)
    theta = made.theta()
    sniffs, wrong = made.problem(theta, quiet=True).sniffs, np.array(theta)
    wrong[:4] += 0.1
    found = at_truth(sniffs, made.known, wrong, theta[:3])
    np.testing.assert_array_equal(found[:3], theta[:3])
    assert found[3] == pytest.approx(theta[3], abs=0.02)


def problem_and_information(made, poses=12):
    theta = made.theta()
    sniffs = made.problem(theta, poses=poses).sniffs
    problem = search_problem(sniffs, made.known)
    expected = problem.predict(theta)
    rows = whiten(expected.rows, expected.along, made.model.fluctuation).rows
    return sniffs, theta, problem, rows.T @ rows


def test_the_schur_complement_is_the_block_of_the_full_inverse(lab):
    made = lab(3, 2, seed=5)
    sniffs, theta, problem, information = problem_and_information(made)
    scale = np.sqrt(np.diag(problem.cov))
    scaled = scale[:, None] * (information + np.linalg.inv(problem.cov)) * scale
    full = np.outer(scale, scale) * np.linalg.inv(scaled)
    np.testing.assert_allclose(scale[:3, None] * np.linalg.inv(marginal_information(scaled)) * scale[:3], full[:3, :3], rtol=1e-6)
    np.testing.assert_allclose(van_trees(sniffs, made.known, theta).cov, full[:3, :3], rtol=1e-6)


def test_a_prior_of_the_source_lowers_the_bound_in_every_direction(lab):
    made = lab(3, 1, seed=6)
    sniffs, theta, _, _ = problem_and_information(made, poses=4)
    without, with_it = (bound(sniffs, made.known, theta).cov for bound in (cramer_rao, van_trees))
    assert np.linalg.eigvalsh(without - with_it).min() > -1e-12
    assert np.linalg.eigvalsh(with_it).min() > 0


def test_the_posterior_bound_is_the_fits_own_covariance_at_its_answer(lab):
    """Of a plume that is the law's; what one that strays adds is not of the readings, and the same in every direction."""
    made = lab(3, 1, seed=7)
    for model_discrepancy in (0.0, 0.2):
        made.law = replace(made.law, model_discrepancy=model_discrepancy)
        made.model = replace(made.model, law=made.law)
        sniffs, theta, problem, _ = problem_and_information(made)
        fit = solve(problem, theta, made.model.fluctuation)
        more = fit.cov[:3, :3] - van_trees(sniffs, made.known, fit.mean).cov
        np.testing.assert_allclose(more, more[0, 0] * np.eye(3), atol=1e-5 * np.max(fit.cov[:3, :3]))
        assert more[0, 0] > 1e-5 if model_discrepancy else more[0, 0] == pytest.approx(0.0, abs=1e-5 * fit.cov[0, 0])


def test_an_arc_has_no_bound_without_a_prior_and_one_with_it(lab):
    """One joint leaves a curve of sources: the unbiased estimate has no finite variance worth the name."""
    made = lab(1, 1, seed=8)
    sniffs, theta, _, _ = problem_and_information(made)
    assert cramer_rao(sniffs, made.known, theta).rms_m > 1.0
    assert van_trees(sniffs, made.known, theta).rms_m < 0.3


def test_no_reading_of_a_source_has_no_bound(lab):
    made = lab(3, 1, seed=9)
    sniffs, theta, _, _ = problem_and_information(made, poses=4)
    theta[3] = -60.0
    assert np.isinf(cramer_rao(sniffs, made.known, theta).rms_m)


def test_the_mean_bound_is_that_of_one_truth_if_the_prior_knows_it(lab):
    made = lab(3, 1, seed=10)
    sniffs, _, problem, _ = problem_and_information(made)
    known = Prior(made.mean, made.cov, made.model)
    one = posterior_cramer_rao(sniffs, known, StandsStill(), 3).cov
    np.testing.assert_allclose(one, van_trees(sniffs, known, problem.mean).cov, rtol=1e-6)


class StandsStill:
    """Draws the prior's mean every time."""

    def standard_normal(self, size):
        return np.zeros(size)


def test_the_mean_bound_lies_below_the_mean_of_the_bounds_and_repeats_with_its_seed(lab):
    """The information is averaged, not its inverse: tr F^-1 is convex (Jensen)."""
    made = lab(3, 1, seed=11)
    sniffs, _, problem, _ = problem_and_information(made)
    draws, root = 12, np.linalg.cholesky(problem.cov)
    truths = problem.mean + np.random.default_rng(3).standard_normal((draws, len(root))) @ root.T
    each = [np.trace(van_trees(sniffs, made.known, theta).cov) for theta in truths]
    mean, again = (posterior_cramer_rao(sniffs, made.known, np.random.default_rng(3), draws).rms_m for _ in range(2))
    assert mean == again and 0 < mean**2 < np.mean(each)


def redrawn(problem, theta, noise, rng, draw):
    """The same path with other readings: those of theta; the lag has settled where it begins."""
    lay, element = problem.layout, problem.sniffs.element
    ppm = np.array(problem.sniffs.ppm)
    start = problem.predict(theta).along.field.mean_ppm[0]
    ppm[0] = start * np.exp(theta[lay.gain][0]) + theta[lay.baseline][0]
    begun = replace(problem, sniffs=replace(problem.sniffs, ppm=ppm))
    expected = begun.predict(theta)
    ppm = expected.ppm + theta[lay.baseline][element] + draw(expected.along, noise, rng)[0]
    return replace(begun, sniffs=replace(problem.sniffs, ppm=ppm))


def test_the_mean_error_over_truths_from_the_prior_does_not_beat_the_posterior_bound(lab, draw):
    made = lab(3, 1, seed=12)
    lay, squares = made.layout, []
    sniffs = made.problem(made.theta(), poses=8).sniffs
    bound = posterior_cramer_rao(sniffs, made.known, np.random.default_rng(0), 200)
    problem = search_problem(sniffs, made.known)
    root = np.linalg.cholesky(problem.cov)
    for _ in range(30):
        theta = problem.mean + root @ made.rng.standard_normal(lay.size)
        fit = solve(redrawn(problem, theta, made.model.fluctuation, made.rng, draw), theta, made.model.fluctuation)
        squares.append(np.sum((fit.mean[:3] - theta[:3]) ** 2))
    assert np.sqrt(np.mean(squares)) > 0.8 * bound.rms_m
