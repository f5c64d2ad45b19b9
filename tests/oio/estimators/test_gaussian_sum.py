"""A bank of filters: moments by hand, weights by the readings, and hypotheses that are begun, kept and dropped."""

from dataclasses import replace

import numpy as np
import pytest

from oio.core.records import Belief, GasReading, JointState
from oio.estimators.ekf import Ekf
from oio.estimators.gaussian_sum import GaussianMixture, GaussianSum, moment_matched
from oio.estimators.odometry import Odometry
from oio.inference.belief_map import BeliefMap
from oio.inference.initial_belief import initial_belief
from oio.inference.map_fit import Fit
from oio.inference.prior import Prior

EKF = Ekf(gate_nis=25.0)
SUM = GaussianSum(component_filter=EKF, gate_nis=25.0, min_weight=1e-4)


def fits_of(made, chi2, moved_m=0.08):
    """So many hypotheses, apart from each other in y."""
    theta = made.theta()
    return tuple(
        Fit(made.layout, theta + moved_m * i * np.eye(len(theta))[1], 0.1 * made.cov, c, 3.0, made.model.fluctuation, 50, made.law)
        for i, c in enumerate(chi2)
    )


def test_moments_by_hand():
    one, other = Belief(5, np.array([1.0, 0.0]), np.eye(2)), Belief(5, np.array([3.0, 0.0]), 2 * np.eye(2))
    both = moment_matched((one, other), np.log([0.25, 0.75]))
    np.testing.assert_allclose(both.mean, [2.5, 0.0])
    np.testing.assert_allclose(both.cov, [[0.25 * (1 + 1.5**2) + 0.75 * (2 + 0.5**2), 0.0], [0.0, 1.75]])
    assert both.t_ns == 5


def test_weights_begin_as_the_evidence(lab):
    """exp(-chi^2 / 2) sqrt(det cov): a difference of 2 ln 2 halves, a covariance half as large halves, and the unlikely are left out."""
    made = lab(3, 1, seed=1)
    one, other, never = fits_of(made, (10.0, 10.0 + 2 * np.log(2.0), 60.0))
    bank = SUM.begin(made.model, (one, other, never), 0, 5)
    np.testing.assert_allclose(np.exp(bank.ln_weights), [2 / 3, 1 / 3])
    np.testing.assert_array_equal(bank.members[0].mean, initial_belief(made.model, one, 0, 5).mean)
    narrow = replace(one, cov=one.cov * 0.25 ** (1 / one.layout.size))
    np.testing.assert_allclose(np.exp(SUM.begin(made.model, (one, narrow), 0, 5).ln_weights), [2 / 3, 1 / 3])


def test_the_hypothesis_that_foretells_the_readings_wins(search):
    model, _, belief, steps = search(3, 2, seed=1)
    s = model.at["s"]
    wrong = np.array(belief.mean)
    wrong[s] += [0.0, 0.1, 0.05]
    bank = moment_matched((Belief(0, wrong, belief.cov), belief), np.log([0.5, 0.5]))
    alone = belief
    for joints, reading in steps:
        bank, alone = SUM.predict(model, bank, joints), EKF.predict(model, alone, joints)
        if reading is not None:
            (bank, _), (alone, _) = SUM.update(model, bank, reading), EKF.update(model, alone, reading)
    assert np.sum(np.exp(bank.ln_weights)) == pytest.approx(1.0)
    best = bank.members[int(np.argmax(bank.ln_weights))]
    np.testing.assert_allclose(best.mean, alone.mean, rtol=1e-9, atol=1e-12)
    assert np.max(bank.ln_weights) > np.log(0.9)


def test_one_update_weighs_by_the_likelihood(search):
    """w_i N(z; z_i, S_i), and the innovation is that of the sum."""
    model, _, belief, _ = search(3, 2, seed=2)
    other = Belief(0, belief.mean + 0.05 * np.eye(model.size)[model.at["f"].start], 2.0 * belief.cov)
    bank, reading = moment_matched((belief, other), np.log([0.3, 0.7])), GasReading(0, 0, float(belief.mean[-2]) + 0.1, 0.05)
    after, innovation = SUM.update(model, bank, reading)
    parts = [EKF.update(model, member, reading)[1] for member in (belief, other)]
    y, s = np.array([p.residual[0] for p in parts]), np.array([p.cov[0, 0] for p in parts])
    likely = np.array([0.3, 0.7]) * np.exp(-0.5 * y**2 / s) / np.sqrt(s)
    np.testing.assert_allclose(np.exp(after.ln_weights), likely / likely.sum())
    assert innovation.residual[0] == pytest.approx([0.3, 0.7] @ y)
    assert innovation.cov[0, 0] == pytest.approx([0.3, 0.7] @ s + 0.21 * (y[0] - y[1]) ** 2)


def test_a_reading_that_one_refuses_is_used_by_the_other(search):
    model, _, belief, _ = search(3, 2, seed=2)
    far = np.array(belief.mean)
    far[model.at["f"]] += 1e4
    bank, reading = moment_matched((belief, Belief(0, far, belief.cov)), np.log([0.5, 0.5])), GasReading(0, 0, float(belief.mean[-2]), 0.05)
    after, innovation = SUM.update(model, bank, reading)
    assert not innovation.gated and len(after.members) == 1 + (np.exp(-12.5) > SUM.min_weight)
    none, innovation = SUM.update(model, bank, replace(reading, ppm=1e9))
    assert innovation.gated and none is bank


def test_odometry_lets_a_filter_begin_itself(lab, built, monkeypatch):
    """The bank from all hypotheses, any other from the best."""
    made = lab(3, 1, seed=3)
    fits = fits_of(made, (10.0, 11.0))
    monkeypatch.setattr(BeliefMap, "locate", lambda *_: fits)
    known = Prior(made.mean, made.cov, made.model)
    joints = JointState(1_000_000_000, made.arm.home, np.zeros(3), np.zeros(3))
    begun = {}
    for name, estimator in (("sum", SUM), ("one", EKF)):
        odometry = Odometry(estimator, known, built("belief_map"))
        monkeypatch.setattr(type(odometry.trace), "as_arrays", lambda _: None)
        odometry.joints(joints)
        odometry.locate(5)
        begun[name] = odometry.belief
    assert isinstance(begun["sum"], GaussianMixture) and len(begun["sum"].members) == 2
    np.testing.assert_array_equal(begun["one"].mean, initial_belief(made.model, fits[0], joints.t_ns, 5).mean)
