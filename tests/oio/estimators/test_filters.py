"""What all filters of conf/ekf share: promises at every rung of the ladder, readings that never came, and where they must agree."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.core.records import Belief, GasReading, JointState
from oio.estimators.ckf import Ckf
from oio.estimators.ekf import Ekf
from oio.estimators.fixed_lag import FixedLag
from oio.estimators.gaussian_sum import GaussianSum
from oio.estimators.iterated import Iterated
from oio.estimators.ukf import Ukf
from oio.testing import check_estimator

CHOICES = sorted(path.stem for path in (Path(__file__).resolve().parents[3] / "conf" / "ekf").glob("*.yaml"))
EKF = Ekf(gate_nis=25.0)
ITERATED = Iterated(gate_nis=25.0, iterations=4, convergence_sigmas=0.01, steps=1000)
LAGGED = FixedLag(gate_nis=25.0, readings=5, iterations=4, convergence_sigmas=0.01, steps=1000)
UKF = Ukf(gate_nis=25.0, alpha=0.3, beta=2.0, kappa=0.0)


def over(estimator, model, belief, steps):
    """The belief after a search, and its innovations."""
    innovations = []
    for joints, reading in steps:
        belief = estimator.predict(model, belief, joints)
        if reading is not None:
            belief, innovation = estimator.update(model, belief, reading)
            innovations.append(innovation)
    return belief, innovations


def same(one, other, tolerance):
    """Equal in standard deviations."""
    scale = np.sqrt(np.diag(one.cov))
    np.testing.assert_allclose((one.mean - other.mean) / scale, 0.0, atol=tolerance)
    np.testing.assert_allclose(one.cov / np.outer(scale, scale), other.cov / np.outer(scale, scale), atol=tolerance)


@pytest.mark.parametrize("dof", [1, 2, 3, 5])
@pytest.mark.parametrize("ekf", CHOICES)
def test_every_filter_keeps_its_promises_at_every_dof(built, search, ekf, dof):
    model, _, belief, steps = search(dof, 1 + dof % 2, seed=dof)
    estimator, joints = built("ekf", f"ekf={ekf}"), steps[0][0]
    predicted = estimator.predict(model, belief, joints)
    blank = GasReading(joints.t_ns, 0, 0.0, 0.05)
    expected, row, r = model.measurement(predicted.mean, blank)
    reading = replace(blank, ppm=expected + float(np.sqrt(row @ predicted.cov @ row + r)))
    check_estimator(estimator, model, belief, joints, reading)


@pytest.mark.parametrize("ppm", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("ekf", CHOICES)
def test_a_missed_reading_is_a_gap(built, search, ekf, ppm):
    model, _, belief, steps = search()
    estimator = built("ekf", f"ekf={ekf}")
    for joints, _ in steps[:3]:
        belief = estimator.predict(model, belief, joints)
    for reading in (GasReading(belief.t_ns, 0, ppm, 0.05), GasReading(belief.t_ns, 0, 1.0, math.nan)):
        after, innovation = estimator.update(model, belief, reading)
        assert after.mean.tobytes() == belief.mean.tobytes() and after.cov.tobytes() == belief.cov.tobytes()
        assert innovation.gated and innovation.nis == 0.0 and innovation.cov[0, 0] > 0


@pytest.mark.parametrize("ekf", CHOICES)
def test_a_long_gap_is_bridged(built, search, ekf):
    """Half of the readings lost, some garbled, and ten seconds of silence."""
    model, _, belief, steps = search()
    estimator, rng = built("ekf", f"ekf={ekf}"), np.random.default_rng(0)
    lost = [(joints, None if rng.random() < 0.5 else reading) for joints, reading in steps]
    garbled = [(joints, reading and replace(reading, ppm=math.nan if rng.random() < 0.2 else reading.ppm)) for joints, reading in lost]
    belief, innovations = over(estimator, model, belief, garbled)
    last = garbled[-1][0]
    after = estimator.predict(model, belief, JointState(last.t_ns + 10**10, last.q, 0.0 * last.dq, last.ddq))
    assert any(innovation.gated for innovation in innovations) and not all(innovation.gated for innovation in innovations)
    assert np.all(np.isfinite(after.mean)) and np.all(np.diag(after.cov) > 0)


def test_one_iteration_is_the_extended_kalman_filter(search):
    model, _, belief, steps = search()
    one, _ = over(replace(ITERATED, iterations=1), model, belief, steps)
    plain, innovations = over(EKF, model, belief, steps)
    same(plain, one, 1e-9)
    assert sum(not innovation.gated for innovation in innovations) > 40


def test_a_window_of_one_reading_is_the_iterated_filter(search):
    model, _, belief, steps = search()
    lagged, _ = over(replace(LAGGED, readings=1), model, belief, steps)
    iterated, _ = over(ITERATED, model, belief, steps)
    assert lagged.mean.tobytes() == iterated.mean.tobytes() and lagged.cov.tobytes() == iterated.cov.tobytes()


def test_one_hypothesis_is_its_filter(search):
    model, _, belief, steps = search()
    summed, told = over(GaussianSum(component_filter=EKF, gate_nis=25.0, min_weight=1e-4), model, belief, steps)
    plain, expected = over(EKF, model, belief, steps)
    same(plain, summed, 1e-12)
    assert [i.nis for i in told] == pytest.approx([i.nis for i in expected])


@pytest.mark.parametrize("estimator", [UKF, Ckf(gate_nis=25.0), ITERATED, LAGGED], ids=["ukf", "ckf", "iterated", "fixed_lag"])
def test_where_nothing_bends_all_are_the_extended_kalman_filter(search, estimator):
    """A covariance so small that a step is a straight line."""
    model, _, belief, steps = search()
    small, joints = Belief(belief.t_ns, belief.mean, 1e-10 * belief.cov), steps[0][0]
    one, other = (e.predict(model, small, joints) for e in (EKF, estimator))
    same(one, other, 1e-6)
    reading = GasReading(joints.t_ns, 0, model.measurement(one.mean, GasReading(joints.t_ns, 0, 0.0, 0.05))[0] + 1e-4, 0.05)
    same(EKF.update(model, one, reading)[0], estimator.update(model, other, reading)[0], 1e-6)


@pytest.mark.parametrize("estimator", [EKF, ITERATED, LAGGED, UKF, Ckf(gate_nis=25.0)], ids=["ekf", "iterated", "fixed_lag", "ukf", "ckf"])
def test_filters_end_near_the_source_and_know_how_near(search, estimator):
    """On data of the model's own, over several searches: never far outside of what is claimed, and narrower than at the beginning."""
    for seed in (1, 2, 3):
        model, theta, belief, steps = search(5, 2, seed=seed, seconds_s=12.0)
        after, _ = over(estimator, model, belief, steps)
        s = model.at["s"]
        error = after.mean[s] - theta[:3]
        assert error @ np.linalg.solve(after.cov[s, s], error) < 30.0
        assert np.trace(after.cov[s, s]) < 0.8 * np.trace(belief.cov[s, s])


@pytest.mark.parametrize(
    ("estimator", "changes"),
    [(EKF, {"gate_nis": 0.1}), (ITERATED, {"iterations": 0}), (LAGGED, {"readings": 0}), (UKF, {"beta": 0.01}), (UKF, {"alpha": 0.0})],
)
def test_senseless_settings_are_refused(estimator, changes):
    with pytest.raises(BadInput, match=next(iter(changes))):
        replace(estimator, **changes)
