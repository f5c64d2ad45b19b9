"""Which world is chosen, what is merged and what stays apart."""

from dataclasses import replace

import numpy as np
import pytest

from oio.gas.source_shape import TWO
from oio.gas.whitening import whiten
from oio.inference.alternatives import extend
from oio.inference.law_extension import LawExtension
from oio.inference.map_fit import CALIBRATED, solve
from oio.inference.metrics import ResidualTest
from oio.inference.residual_test import Candidate, residual_test, split_half, with_raised_noise
from oio.inference.world_posterior import (
    distinct,
    either_source,
    exchanged,
    extended_source,
    hypotheses,
    merged,
    plausible,
    stronger_first,
    within_prior,
)


@pytest.fixture(scope="module")
def fitted(lab):
    """A problem and its fit."""
    made = lab(3, 1, seed=80)
    theta = made.theta()
    problem = made.problem(theta, poses=10)
    return problem, solve(problem, theta, made.model.fluctuation)


@pytest.fixture(scope="module")
def with_second(fitted):
    """A fit with a second source: weaker by 0.4 +- 0.1 in ln."""
    problem, fit = fitted
    more = extend(problem, LawExtension(TWO), [(range(4), np.diag([0.01, 0.01, 0.01, 1.0]))])
    n = problem.layout.size
    mean, cov = np.concatenate([fit.mean, fit.source + np.array([0.0, 0.1, 0.0]), [-0.4]]), np.zeros((n + 4, n + 4))
    cov[:n, :n], cov[n:, n:] = fit.cov, np.diag([4e-4, 4e-4, 4e-4, 0.01])
    return replace(fit, layout=more.layout, mean=mean, cov=cov, extension=more.extension, world="a second source", charged=4.6)


def at(fit, evidence, moved_m=0.0, world=CALIBRATED, sd=1.0):
    mean, cov = np.array(fit.mean), np.array(fit.cov)
    mean[0] += moved_m
    cov[:3, :3] *= sd**2
    return replace(fit, mean=mean, cov=cov, minus_2_log_evidence=evidence, world=world)


def test_evidence_is_the_integral_of_a_linear_gaussian(lab):
    """A free offset of unit whitened row h changes -2 ln Z of residuals z by ln(1 + h'h) - (h'z)^2 / (1 + h'h)."""
    made = lab(3, 1, seed=81)
    theta = made.theta()
    b = made.layout.baseline.start
    known = 1e-14 * np.eye(len(theta))
    cov = np.array(known)
    cov[b, b] = 0.2**2
    problem = replace(made.problem(theta, poses=4), mean=theta, cov=cov)
    fit, fixed = (solve(p, theta, made.model.fluctuation) for p in (problem, replace(problem, cov=known)))
    expected = problem.predict(theta)
    stacked = np.stack([problem.residual(theta, expected.ppm), 0.2 * expected.rows[:, b]], axis=1)
    z, h = whiten(stacked, expected.along, made.model.fluctuation).rows.T
    gain = np.log(1.0 + h @ h) - (h @ z) ** 2 / (1.0 + h @ h)
    assert fit.minus_2_log_evidence - fixed.minus_2_log_evidence == pytest.approx(gain, abs=0.05)


def test_worse_worlds_are_left_out_and_better_ones_come_first(fitted):
    _, fit = fitted
    found = hypotheses([at(fit, 10.0, 0.2), at(fit, 3.0), at(fit, 30.0, 0.3)], keep=7.81, separation_m=0.025, temper=1.0)
    assert [f.minus_2_log_evidence for f in found] == [3.0, 10.0]
    assert len(hypotheses([at(fit, 10.0, 0.2), at(fit, 3.0), at(fit, 30.0, 0.3)], 7.81, 0.025, temper=4.0)) == 3


def test_fits_of_one_place_are_one_hypothesis_with_the_mixtures_spread(fitted):
    _, fit = fitted
    (both,) = hypotheses([at(fit, 0.0), at(fit, 2.0 * np.log(3.0), 0.02, "another wind")], 7.81, 0.025, 1.0)
    np.testing.assert_array_equal(both.mean, fit.mean)
    added = both.source_cov - fit.source_cov
    assert added[0, 0] == pytest.approx(0.25 * 0.02**2) and added[1, 1] == pytest.approx(0.0, abs=1e-12)  # weights 3 : 1


def test_merging_never_narrows(fitted):
    _, fit = fitted
    one = merged([at(fit, 0.0), at(fit, 0.0, 0.0, "another wind", sd=0.3), at(fit, 0.0, 0.0, "a wall", sd=2.0)], 1.0)
    assert np.all(np.linalg.eigvalsh(one.source_cov - fit.source_cov) > -1e-15)
    np.testing.assert_allclose(one.source_cov, fit.source_cov * (1.0 + 3.0 / 3.0))  # a third of the weight has three times more


def test_minima_of_one_world_are_kept_where_they_are_apart(fitted):
    problem, fit = fitted
    kept = distinct([Candidate(problem, at(fit, e, m)) for e, m in ((5.0, 0.0), (1.0, 0.01), (6.0, 0.1), (20.0, 0.2))], 0.025, 7.81)
    assert [c.fit.minus_2_log_evidence for c in kept] == [1.0, 6.0]


def test_sources_are_exchanged_there_and_back(with_second):
    back = exchanged(exchanged(with_second))
    np.testing.assert_allclose(back.mean, with_second.mean)
    np.testing.assert_allclose(back.cov, with_second.cov, atol=1e-15)
    other = exchanged(with_second)
    n = with_second.layout.base
    np.testing.assert_allclose(other.source, with_second.mean[n : n + 3])
    assert other.mean[3] == pytest.approx(with_second.mean[3] - 0.4) and other.mean[n + 3] == pytest.approx(0.4)


def test_the_stronger_source_is_the_source(with_second):
    assert stronger_first(exchanged(with_second)).source == pytest.approx(with_second.source)
    assert stronger_first(with_second) is with_second
    assert either_source(with_second) == (with_second,)  # by 0.4 +- 0.1


def doubtful(fit, ln_strength, second_sd_m):
    """The fit while it is open (+- 1) which of its sources is the stronger, the second with this standard deviation on each axis."""
    n, mean, cov = fit.layout.base, np.array(fit.mean), np.array(fit.cov)
    mean[n + 3], cov[n + 3, n + 3] = ln_strength, 1.0
    cov[n : n + 3, n : n + 3] = second_sd_m**2 * np.eye(3)
    return replace(fit, mean=mean, cov=cov)


def test_while_it_is_open_which_is_stronger_both_are_hypotheses(with_second):
    open_which = doubtful(with_second, -0.4, 0.02)
    first, second = either_source(open_which)
    assert first is open_which and second.source == pytest.approx(open_which.mean[open_which.layout.base :][:3])
    assert second.minus_2_log_evidence == pytest.approx(first.minus_2_log_evidence + 4.6)


@pytest.mark.parametrize("ln_strength, second_sd_m, second_leads", [(0.4, 0.01, True), (-0.4, 0.001, False), (0.4, 0.1, False)])
def test_the_likelier_stronger_leads_unless_it_is_vague(with_second, ln_strength, second_sd_m, second_leads):
    located = replace(with_second, cov=np.where(np.eye(with_second.layout.size) > 0, 1e-4, 0.0))
    open_which = doubtful(located, ln_strength, second_sd_m)
    leads = stronger_first(open_which).source
    second = open_which.mean[open_which.layout.base :][:3]
    assert leads == pytest.approx(second if second_leads else open_which.source)
    assert stronger_first(exchanged(open_which)).source == pytest.approx(leads)


def test_an_alternative_may_not_put_the_source_out_of_reach(fitted):
    problem, fit = fitted
    assert plausible(problem, fit) and not plausible(problem, at(fit, 0.0, 1.0))


def test_start_values_are_moved_into_the_prior(fitted):
    problem, fit = fitted
    far = np.array(fit.mean)
    far[5:8] = 1e3
    near = within_prior(problem, far)
    assert np.all(np.abs(near - problem.mean)[5:8] <= 3.0 * np.sqrt(np.diag(problem.cov))[5:8] * (1 + 1e-9))
    np.testing.assert_array_equal(near[:3], far[:3])


def test_residuals_of_its_own_world_are_white_and_of_another_are_not(lab):
    made = lab(3, 1, seed=83)
    theta = made.theta()
    problem = made.problem(theta, poses=30)
    own = residual_test(problem, solve(problem, theta, made.model.fluctuation))
    assert own.mean_square == pytest.approx(1.0, abs=0.35) and abs(own.autocorrelation) < 0.25
    stepped = replace(problem, sniffs=replace(problem.sniffs, ppm=problem.sniffs.ppm * np.where(problem.sniffs.at % 200 < 100, 1.0, 2.5)))
    other = residual_test(stepped, solve(stepped, theta, made.model.fluctuation))
    assert other.mean_square > 2.0 * own.mean_square and other.overdispersion > 2.0


def test_halves_agree_in_one_world_and_not_where_it_changed(lab):
    """In each of the changed ones, half of the readings, in time or on one side, are of a source that lies 8 cm to one side."""
    same, changed = [], []
    for seed in range(300, 306):
        made = lab(3, 1, seed=seed)
        theta, moved = (theta := made.theta()), np.array(theta)
        moved[1] -= 0.08 * np.sign(theta[1])
        problem, noise = made.problem(theta, poses=60), made.model.fluctuation
        sniffs, elsewhere, away = problem.sniffs, problem.expect(moved) - problem.expect(theta), problem.nose(theta) - theta[:3]
        same.append(split_half(problem, solve(problem, theta, noise)))
        halves = (sniffs.reading_t_s > np.median(sniffs.reading_t_s), away[sniffs.at, 1] > 0.0, away[sniffs.at, 0] > 0.0)
        mixed = [replace(problem, sniffs=replace(sniffs, ppm=sniffs.ppm + half * elsewhere)) for half in halves]
        changed.append([split_half(each, solve(each, theta, noise)) for each in mixed])
    assert max(same) < 8.0
    assert np.all(np.median(changed, axis=0) > 8.0) and np.all(np.max(changed, axis=0) > 16.3)


def test_overdispersion_is_never_below_one():
    assert ResidualTest(0.3, -0.5).overdispersion == 1.0
    assert ResidualTest(2.0, 0.5).overdispersion == pytest.approx(6.0)


def test_noise_is_raised_where_the_residuals_ask_for_it_and_never_lowered(lab):
    made = lab(3, 1, seed=84)
    theta = made.theta()
    problem, noise = made.problem(theta, poses=20), made.model.fluctuation
    for factor, raised in ((1.0, False), (0.2, True), (5.0, False)):
        assumed = replace(noise, gamma=factor * noise.gamma)
        law = replace(problem.law, model_discrepancy=0.02, nose_jitter_m=1e-4)
        start = Candidate(replace(problem, law=law), solve(replace(problem, law=law), theta, assumed))
        (after,) = with_raised_noise([start], 10.0)
        assert (after.fit.fluctuation.gamma > assumed.gamma) is raised, factor
        assert np.trace(after.fit.source_cov) >= np.trace(start.fit.source_cov) * (1 - 1e-9)


def test_two_near_sources_may_be_one_that_is_extended(with_second):
    """Weights 1 : exp(-0.4), 10 cm apart along y: the second moment about the first is 0.4 of 1 cm^2 m^2."""
    wide = extended_source(with_second)
    np.testing.assert_allclose(np.diag(wide.source_cov - with_second.source_cov), [0.0, 0.01 / (1.0 + np.exp(0.4)), 0.0], atol=1e-12)
    far = np.array(with_second.mean)
    far[with_second.layout.base + 1] += 0.1
    apart = replace(with_second, mean=far)
    assert extended_source(apart) is apart
