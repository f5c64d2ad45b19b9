"""Sway of the plume: its filter against a dense covariance, its likelihood and evidence, and what has no states for it."""

from dataclasses import replace

import numpy as np
import pytest

from oio.gas.fluctuation import Fluctuation, MeanField, PathField, lagged_ou_steps, with_sway
from oio.gas.sway_whitening import sway_filter, sway_height, sway_steps
from oio.gas.whitening import lagged_ou_path, whiten
from oio.inference.likelihoods import GAMMAS, TIMES_S, fit_fluctuation, minus_2_log_likelihoods
from oio.inference.noise_evidence import SWAYS, likeliest_sway, minus_2_log_evidence

NOISE = Fluctuation(1.5, 0.2, 0.5, sway=0.3, sway_s=4.0)


def along_of(steps, *, every=1, tau=0.8, turns_per_s=0.2, gain=1.0, mean=10.0):
    """A nose that circles the source at 10 cm."""
    full = lambda value: np.full(steps, float(value))  # noqa: E731
    dt, at = np.where(np.arange(steps) > 0, 0.1, 0.0), np.arange(0, steps, every)
    angle = 2.0 * np.pi * turns_per_s * np.cumsum(dt)
    by_wind_m = 0.1 * np.stack([np.cos(angle), np.sin(angle), full(0.0)], axis=1)
    field = MeanField(full(mean), full(1.0), full(0.1), full(0.0), 0.0, 0.0, 0.1, by_wind_m)
    return PathField(field, dt, full(tau), at, np.full(len(at), gain), np.full(len(at), 0.09))


def draw(along, noise, rng, count):
    """Deviations of readings (count, m) from their mean, of the process itself."""
    f, k = along.field, len(along.dt_s)
    eddies = lagged_ou_steps(along.dt_s, along.tau_s, 1.0 / replace(noise, sway=0.0).rate(f), f.mean_ppm, noise.gamma**2)
    sways, heights = lagged_ou_steps(along.dt_s, along.tau_s, np.full(k, noise.sway_s), np.ones(k), noise.sway**2), sway_height(f)
    lagged, m = np.zeros(count), noise.gamma * rng.standard_normal(count)
    q, white, out = (
        noise.sway * rng.standard_normal((3, count)),
        np.sqrt(noise.scale * along.variance_ppm2),
        np.empty((count, len(along.at))),
    )
    lagged += white[0] / along.gain[0] * rng.standard_normal(count)
    for i in range(k):
        if i:
            parts = [(eddies[i], 1.0, m), *((sways[i], heights[i, a], q[a]) for a in range(3))]
            new = parts[0][0][0] * lagged
            for (_, coupling, _, q00, q01, q11), height, state in parts:
                noise_cov = np.array([[height**2 * q00, height * q01], [height * q01, q11]])
                pushed = np.linalg.cholesky(noise_cov + 1e-15 * np.eye(2)) @ rng.standard_normal((2, count))
                new = new + height * coupling * state + pushed[0]
                state *= sways[i][2] if state is not m else eddies[i][2]
                state += pushed[1]
            lagged = new
        if i in along.at:
            j = int(np.flatnonzero(along.at == i)[0])
            out[:, j] = along.gain[j] * lagged + white[j] * rng.standard_normal(count)
    return out


def test_the_implied_covariance_is_that_of_the_process():
    """Without lag: gain^2 c^2 (gamma^2 keep^|i - j| + sway^2 keep_q^|i - j| g_i . g_j) + white. Opposite sides are anti-correlated."""
    along = along_of(12, tau=1e-9, gain=1.5)
    lower = np.linalg.inv(whiten(np.eye(12), along, NOISE).rows[1:, 1:])
    late = np.abs(np.subtract.outer(np.arange(11), np.arange(11))) * 0.1
    g = along.field.by_wind_m[1:] / 0.1
    expected = (15.0) ** 2 * (0.2**2 * np.exp(-late / 0.5) + 0.3**2 * np.exp(-late / 4.0) * (g @ g.T)) + 1.5 * 0.09 * np.eye(11)
    np.testing.assert_allclose(lower @ lower.T, expected, rtol=1e-6, atol=1e-6)


def test_with_lag_it_is_that_of_many_draws():
    along = along_of(31, every=5, tau=0.4)
    drawn = draw(along, NOISE, np.random.default_rng(0), 40_000)
    lower = np.linalg.inv(whiten(np.eye(7), along, NOISE).rows[1:, 1:])
    np.testing.assert_allclose(lower @ lower.T, np.cov(drawn[:, 1:].T), atol=0.03 * np.max(np.var(drawn[:, 1:], axis=0)))


def test_without_a_sway_it_is_the_filter_of_two_states():
    along, rows = along_of(60, every=3), np.random.default_rng(1).standard_normal((20, 4))
    plain = replace(NOISE, sway=0.0)
    f = along.field
    numbers = (f.slope_m, f.model_discrepancy, f.r_ref_m, plain.gamma, plain.t_s)
    steps = lagged_ou_path(f.mean_ppm, f.rarity, f.r_m, f.speed_m_s, along.dt_s, along.tau_s, numbers)
    none, white = sway_steps(along.dt_s, along.tau_s, 1e-12, 4.0), plain.scale * along.variance_ppm2
    found = sway_filter(rows, along.at, steps, none, sway_height(f), (plain.gamma**2, 1e-24), along.gain, white)
    expected = whiten(rows, along, plain)
    np.testing.assert_allclose(found[0], expected.rows, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found[1], expected.expected_ppm2, rtol=1e-9)


def test_many_tried_at_once_are_as_likely_as_one_by_one():
    along = along_of(200, every=2)
    z = draw(along, NOISE, np.random.default_rng(8), 1)[0]
    shapes = [(0.0, 0.0, float(gamma)) for gamma in GAMMAS]
    singly = [
        [whiten(z[:, None], along, replace(NOISE, gamma=float(g), t_s=float(t))).minus_2_log_likelihood for t in TIMES_S] for g in GAMMAS
    ]
    np.testing.assert_array_equal(minus_2_log_likelihoods(z, along, NOISE, shapes, TIMES_S), singly)


def test_maximum_likelihood_of_the_eddies_keeps_the_sway():
    along = along_of(4000, every=2)
    found = fit_fluctuation(draw(along, NOISE, np.random.default_rng(4), 1)[0], along, NOISE)
    assert found.gamma == pytest.approx(NOISE.gamma, rel=0.4)
    assert (found.sway, found.sway_s) == (NOISE.sway, NOISE.sway_s)


def test_evidence_is_that_of_a_normal_distribution():
    """With rows R and a standard normal u, residuals at u = 0 have the covariance C + R R'."""
    along, rng = along_of(15, tau=1e-9), np.random.default_rng(5)
    rows, z = rng.standard_normal((15, 3)), rng.standard_normal(15)
    z[0] = rows[0] = 0.0  # the first reading tells nothing
    lower = np.linalg.inv(whiten(np.eye(15), along, NOISE).rows[1:, 1:])
    cov = lower @ lower.T + rows[1:] @ rows[1:].T
    expected = z[1:] @ np.linalg.solve(cov, z[1:]) + np.linalg.slogdet(cov)[1]
    for u in (np.zeros(3), np.array([0.3, -1.0, 0.5])):  # about any u
        columns = np.column_stack([z - rows @ u, rows])
        assert minus_2_log_evidence(columns, u, along, NOISE) == pytest.approx(expected)


@pytest.mark.parametrize("sway", [0.0, 0.2])
def test_the_likeliest_sway_is_near_the_true_one_though_parameters_follow_it(sway):
    """The rows are what an unknown place of the source does: a residual that is as c g."""
    along, rng = along_of(3000, every=5), np.random.default_rng(6)
    z = draw(along, replace(NOISE, sway=max(sway, 1e-9), scale=1.0), rng, 1)[0]
    columns = np.column_stack([z, 3.0 * sway_height(along.field)[along.at]])
    found = likeliest_sway(columns, np.zeros(3), along, replace(NOISE, scale=1.0))
    assert found.sway == pytest.approx(sway, abs=0.07)
    assert min(SWAYS) <= found.sway <= max(SWAYS)


def test_without_states_for_it_it_is_part_of_the_fluctuation():
    """Variances add, and rates are weighted with them."""
    field = along_of(1).field
    plain = replace(NOISE, sway=0.0)
    assert NOISE.height(field)[0] ** 2 == pytest.approx(plain.height(field)[0] ** 2 + (0.3 / 0.2) ** 2)
    share = 1.5**2 / (1.0 + 1.5**2)
    assert NOISE.rate(field)[0] == pytest.approx((1.0 - share) * plain.rate(field)[0] + share / 4.0)
    assert with_sway(1.0, 0.5, 1.5, 4.0) == pytest.approx((NOISE.height(field)[0], 1.0 / NOISE.rate(field)[0]))
    assert with_sway(1.0, 0.5, 0.0, 4.0) == (1.0, 0.5)
