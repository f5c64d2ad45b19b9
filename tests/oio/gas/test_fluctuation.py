"""Whitening: against a dense covariance, on data of the model's own, and the fit of gamma and T."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from oio.gas.fluctuation import Fluctuation, MeanField, PathField, lagged_ou_steps
from oio.gas.whitening import whiten
from oio.inference.likelihoods import GAMMAS, TIMES_S, fit_fluctuation, minus_2_log_likelihoods


def along_of(steps, *, every=2, tau=0.8, mean=10.0, rarity=1.0, r=0.1, speed=0.0, sigma=0.3, gain=1.0, slope=0.0, model_discrepancy=0.0):
    full = lambda value: np.full(steps, float(value))  # noqa: E731
    at = np.arange(0, steps, every)
    field = MeanField(full(mean), full(rarity), full(r), full(speed), slope, model_discrepancy, 0.1, np.zeros((steps, 3)))
    dt = np.where(np.arange(steps) > 0, 0.1, 0.0)  # the first reading is where the path begins
    return PathField(field, dt, full(tau), at, np.full(len(at), gain), np.full(len(at), sigma**2))


def test_the_implied_covariance_is_that_of_the_process():
    """Without lag, of all readings but the first: gain^2 swing^2 gamma^2 keep^|i - j| + white."""
    along, noise = along_of(12, every=1, tau=1e-9, gain=1.5), Fluctuation(2.0, 0.4, 0.5)
    white = whiten(np.eye(12), along, noise)
    lower = np.linalg.inv(white.rows[1:, 1:])
    keep = np.exp(-0.1 / 0.5)
    i = np.arange(11)
    expected = (1.5 * 10.0 * 0.4) ** 2 * keep ** np.abs(i[:, None] - i) + 2.0 * 0.3**2 * np.eye(11)
    np.testing.assert_allclose(lower @ lower.T, expected, rtol=1e-7)
    assert np.sum(np.log(white.expected_ppm2)) == pytest.approx(np.linalg.slogdet(expected)[1])


def test_with_lag_it_is_that_of_many_draws(draw):
    along, noise = along_of(16, every=3, tau=0.4), Fluctuation(1.0, 0.4, 0.5)
    rng = np.random.default_rng(0)
    drawn = draw(along, noise, rng, 40_000, unsure=0.3)[:, 1:]
    lower = np.linalg.inv(whiten(np.eye(6), along, noise).rows[1:, 1:])
    np.testing.assert_allclose(lower @ lower.T, np.cov(drawn.T), atol=0.03 * np.max(np.var(drawn, axis=0)))


def test_likelihood_is_gauss_given_the_first_reading():
    along, noise = along_of(9, every=1, tau=1e-9), Fluctuation(1.0, 0.4, 0.5)
    z = np.random.default_rng(1).standard_normal(8)
    lower = np.linalg.inv(whiten(np.eye(9), along, noise).rows[1:, 1:])
    dense = lower @ lower.T
    by_hand = z @ np.linalg.solve(dense, z) + np.linalg.slogdet(dense)[1]
    assert whiten(np.array([[7.0], *z[:, None]]), along, noise).minus_2_log_likelihood == pytest.approx(by_hand)


@pytest.mark.parametrize("noise", [Fluctuation(1.0, 0.3, 0.5), Fluctuation(2.0, 0.05, 3.0)])
def test_readings_of_the_model_become_white(draw, noise):
    along = along_of(8000, rarity=2.0, speed=0.02, slope=0.003, model_discrepancy=0.1)
    z = draw(along, noise, np.random.default_rng(2))[0]
    white = whiten(z[:, None], along, noise).rows[1:, 0]
    m = len(white)
    assert np.mean(white**2) == pytest.approx(1.0, abs=4 * np.sqrt(2 / m))
    assert abs(np.mean(white[1:] * white[:-1])) < 4 / np.sqrt(m)
    assert np.corrcoef(z[1:], z[:-1])[0, 1] > 0.15  # they were not white before


def test_the_first_reading_is_where_the_lag_begins_and_tells_nothing_more():
    along, noise, rows = along_of(20), Fluctuation(1.0, 0.3, 0.5), np.ones((10, 1))
    white = whiten(rows, along, noise).rows
    rows[0] = 100.0
    assert white[0, 0] == 0.0
    np.testing.assert_array_equal(whiten(rows, along, noise).rows, white)


@pytest.mark.parametrize("sway", [0.0, 0.3])
@pytest.mark.parametrize("decades", [8, 16, 100])
def test_gas_supposed_beyond_all_digits_leaves_a_variance_and_a_likelihood(decades, sway):
    """A start far from the truth may suppose any concentration; NaN would win every comparison of likelihoods."""
    rng = np.random.default_rng(decades)
    for _ in range(100):
        k = 100
        dt = np.where(rng.random(k) < 0.1, 0.0, 10 ** rng.uniform(-6, 2, k))
        mean, r = 10 ** rng.uniform(-3, decades, k), 10 ** rng.uniform(-3, 0, k)
        field = MeanField(mean, np.ones(k), r, rng.uniform(0, 0.3, k), 0.002, 0.1, 0.3, r[:, None] * rng.standard_normal((k, 3)))
        along = PathField(field, dt, np.full(k, 0.8), np.arange(k), np.ones(k), np.full(k, 0.1))
        white = whiten(rng.standard_normal((k, 1)), along, Fluctuation(1.0, 0.3, 1.0, sway=sway))
        assert np.all(white.expected_ppm2[1:] >= 0.1)
        assert np.isfinite(white.minus_2_log_likelihood)


def test_columns_do_not_meddle():
    along, noise, rows = along_of(20), Fluctuation(1.0, 0.3, 0.5), np.random.default_rng(3).standard_normal((10, 4))
    both = whiten(rows, along, noise).rows
    np.testing.assert_array_equal(both[:, 2:3], whiten(rows[:, 2:3], along, noise).rows)
    np.testing.assert_allclose(whiten(3.0 * rows, along, noise).rows, 3.0 * both)


@pytest.mark.parametrize("truth", [Fluctuation(1.0, 0.1, 0.4), Fluctuation(1.0, 0.6, 2.0)])
def test_maximum_likelihood_finds_gamma_and_time(draw, truth):
    along = along_of(6000)
    found = fit_fluctuation(draw(along, truth, np.random.default_rng(4))[0], along, truth)
    assert found.gamma == pytest.approx(truth.gamma, rel=0.4)
    assert 0.5 < found.t_s / truth.t_s < 2.0


def test_many_tried_at_once_are_as_likely_as_one_by_one(draw):
    along = along_of(200, slope=0.002, model_discrepancy=0.05, rarity=2.0, r=0.13, speed=0.02)
    z = draw(along, Fluctuation(1.3, 0.3, 1.0), np.random.default_rng(8))[0]
    shapes = [(along.field.slope_m, along.field.model_discrepancy, float(gamma)) for gamma in GAMMAS]
    singly = [[whiten(z[:, None], along, Fluctuation(1.3, float(g), float(t))).minus_2_log_likelihood for t in TIMES_S] for g in GAMMAS]
    np.testing.assert_array_equal(minus_2_log_likelihoods(z, along, Fluctuation(1.3, 0.3, 1.0), shapes, TIMES_S), singly)


def test_height_and_rate_by_hand():
    """h^2 = I + (n u_p / gamma r)^2 + (w ln(r / r_ref) / gamma)^2, rate = (r_ref / T + v) / r."""
    field = along_of(1, rarity=4.0, r=0.2, speed=0.05, slope=0.003, model_discrepancy=0.1).field
    noise = Fluctuation(1.0, 0.5, 2.0)
    assert noise.height(field)[0] ** 2 == pytest.approx(4.0 + (0.003 / 0.2 / 0.5) ** 2 + (0.1 * np.log(2.0) / 0.5) ** 2)
    assert noise.rate(field)[0] == pytest.approx((0.1 / 2.0 + 0.05) / 0.2)


positive = st.floats(0.02, 20.0)


def step_of(dt, tau, t, swing, gamma):
    """F and Q (2, 2) of `lagged_ou_steps`."""
    a, b, k, q00, q01, q11 = lagged_ou_steps(np.array([dt]), np.array([tau]), np.array([t]), np.array([swing]), gamma**2)[0]
    return np.array([[a, b], [0.0, k]]), np.array([[q00, q01], [q01, q11]])


@settings(deadline=None)
@given(positive, positive, positive, positive, positive)
def test_a_step_is_the_exact_solution(dt, tau, t, swing, gamma):
    """Van Loan 1978: expm([[-A, G], [0, A']] dt) = [[., F^-1 Q], [0, F']]."""
    a, g = np.array([[-1 / tau, swing / tau], [0.0, -1 / t]]), np.diag([0.0, 2 * gamma**2 / t])
    dt = min(dt, 3 * min(tau, t))  # the matrix exponential itself is ill conditioned beyond
    block = expm(np.block([[-a, g], [np.zeros((2, 2)), a.T]]) * dt)
    f, q = step_of(dt, tau, t, swing, gamma)
    scale = np.array([swing, 1.0]) * gamma
    np.testing.assert_allclose(f, block[2:, 2:].T, rtol=1e-5, atol=1e-6 * swing)
    np.testing.assert_allclose(q / np.outer(scale, scale), block[2:, 2:].T @ block[:2, 2:] / np.outer(scale, scale), atol=1e-6)


@settings(deadline=None)
@given(positive, positive, positive)
def test_two_half_steps_are_one_step(dt, tau, t):
    f, q = step_of(dt / 2, tau, t, 3.0, 0.4)
    whole_f, whole_q = step_of(dt, tau, t, 3.0, 0.4)
    np.testing.assert_allclose(f @ f, whole_f, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(f @ q @ f.T + q, whole_q, rtol=1e-6, atol=1e-9)


def test_equal_times_are_no_exception():
    f, q = step_of(0.3, 1.0, 1.0, 3.0, 0.4)
    near_f, near_q = step_of(0.3, 1.0, 1.0 + 1e-5, 3.0, 0.4)
    np.testing.assert_allclose(f, near_f, rtol=1e-4)
    np.testing.assert_allclose(q, near_q, rtol=1e-4)
