"""Sigma points: moments of what bends by hand, covariances whose scales differ by 20 orders, and those that rounding made singular."""

import numpy as np
import pytest

from oio.core.records import Belief
from oio.estimators.ckf import Ckf
from oio.estimators.propagation import propagate_mean
from oio.estimators.sigma_points import MIN_EIGENVALUE, nearest_positive_definite
from oio.estimators.ukf import Ukf

FILTERS = [Ckf(gate_nis=25.0), Ukf(gate_nis=25.0, alpha=0.3, beta=2.0, kappa=0.0), Ukf(gate_nis=25.0, alpha=1.0, beta=2.0, kappa=0.0)]


def test_a_singular_correlation_is_mended_and_a_good_one_left_alone():
    rng = np.random.default_rng(0)
    good = np.corrcoef(rng.standard_normal((6, 50)))
    assert nearest_positive_definite(good) is good
    twin = np.ones((3, 3)) - 1e-15 * np.ones((3, 3)) + 1e-15 * np.eye(3)
    mended = nearest_positive_definite(twin)
    np.testing.assert_allclose(mended, twin, atol=10 * MIN_EIGENVALUE)
    np.linalg.cholesky(mended)


@pytest.mark.parametrize("estimator", FILTERS)
def test_scales_that_differ_by_20_orders(search, estimator):
    model, _, belief, steps = search(3, 2, seed=1)
    sd = 10.0 ** np.linspace(-9, -4, model.size)
    sd[model.at["f"]], sd[model.at["b"]] = 1e2, 1e1
    after = estimator.predict(model, Belief(0, belief.mean, np.outer(sd, sd) * np.eye(model.size)), steps[0][0])
    s, q = model.at["s"], model.process_noise_diagonal(0.05)
    np.testing.assert_allclose(np.diag(after.cov)[s], (sd**2 + q)[s], rtol=1e-9)
    assert np.all(np.linalg.eigvalsh(after.cov / np.sqrt(np.outer(*(2 * [np.diag(after.cov)])))) > -1e-9)


@pytest.mark.parametrize("estimator", FILTERS)
def test_moments_of_the_gas_are_those_of_many_draws(search, estimator):
    """Where the source is uncertain by centimetres the mean of the gas is not the gas at the mean."""
    model, _, belief, steps = search(3, 2, seed=2)
    joints, f, s = steps[20][0], model.at["f"].start, model.at["s"]
    cov = 1e-12 * np.eye(model.size)
    cov[s, s] = 0.01**2 * np.eye(3)
    start, rng = Belief(0, belief.mean, cov), np.random.default_rng(3)
    after, drawn = estimator.predict(model, start, joints), np.array(belief.mean) + 1e-6 * rng.standard_normal((20_000, model.size))
    drawn[:, s] = belief.mean[s] + 0.01 * rng.standard_normal((20_000, 3))
    gas = propagate_mean(model, drawn, joints.t_ns / 1e9, joints)[:, f]
    plain = model.transition(belief.mean, joints.t_ns / 1e9, joints)[0][f]
    assert abs(after.mean[f] - np.mean(gas)) < 0.5 * abs(plain - np.mean(gas)) + 0.1 * np.std(gas) / np.sqrt(200)
