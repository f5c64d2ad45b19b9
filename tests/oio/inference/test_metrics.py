"""Scores of a source: position, or bearing where that is all that can be seen."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2

from oio.inference.metrics import CHI2_95, SourceScore, bearing, nees, rms, score_source

directions = st.tuples(*[st.floats(-1, 1)] * 3).map(np.array).filter(lambda d: np.hypot(d[0], d[1]) > 0.05)


def test_nees_by_hand():
    assert nees(np.array([0.02, 0.0, 0.03]), np.diag([0.01**2, 1.0, 0.03**2])) == pytest.approx(5.0)


def test_nees_of_its_own_distribution_is_chi_square():
    rng = np.random.default_rng(0)
    root = rng.standard_normal((3, 3))
    values = [nees(root @ rng.standard_normal(3), root @ root.T) for _ in range(4000)]
    assert np.mean(values) == pytest.approx(3.0, rel=0.05)
    assert np.mean([SourceScore(0.0, None, v, 3).inside_95 for v in values]) == pytest.approx(0.95, abs=0.015)


def test_inside_95_is_the_chi_square_of_its_dimension():
    for dimension in (1, 2, 3):
        limit = chi2.ppf(0.95, dimension)
        assert SourceScore(None, 0.0, limit - 1e-6, dimension).inside_95
        assert not SourceScore(None, 0.0, limit + 1e-6, dimension).inside_95


def test_the_95_percent_quantiles_are_those_of_chi_square():
    assert [CHI2_95[k] for k in (1, 2, 3)] == pytest.approx([chi2.ppf(0.95, k) for k in (1, 2, 3)], rel=1e-14)


@given(directions)
def test_bearings_jacobian_is_the_central_difference(d):
    angles, jacobian = bearing(d)
    h = 1e-6
    for j in range(3):
        step = h * np.eye(3)[j]
        change = bearing(d + step)[0] - bearing(d - step)[0]
        change[0] = (change[0] + np.pi) % (2 * np.pi) - np.pi
        np.testing.assert_allclose(jacobian[:, j], change / (2 * h), rtol=1e-4, atol=1e-5)
    assert -np.pi <= angles[0] <= np.pi and abs(angles[1]) <= np.pi / 2


def test_bearing_by_hand():
    np.testing.assert_allclose(np.degrees(bearing(np.array([0.0, 1.0, 1.0]))[0]), [90.0, 45.0])


@pytest.mark.parametrize("dof", [3, 5])
def test_from_three_joints_on_the_position_counts(built, dof):
    score = score_source(np.array([0.3, 0.0, 0.2]), 1e-4 * np.eye(3), np.array([0.3, 0.03, 0.24]), built("arm", f"dof={dof}"))
    assert score.source_error_m == pytest.approx(0.05) and score.bearing_error_deg is None
    assert score.nees == pytest.approx(25.0) and score.dimension == 3 and not score.inside_95


def test_one_joint_sees_an_azimuth_and_no_range(built):
    arm = built("arm", "dof=1")
    mean, turned = arm.shoulder + np.array([0.3, 0.0, 0.1]), arm.shoulder + 0.5 * np.array([np.cos(0.1), np.sin(0.1), 2.0])
    score = score_source(mean, 1e-4 * np.eye(3), turned, arm)
    assert score.source_error_m is None and score.dimension == 1
    assert score.bearing_error_deg == pytest.approx(np.degrees(0.1))
    assert score.nees == pytest.approx(0.1**2 / (0.01 / 0.3) ** 2)


def test_two_joints_see_azimuth_and_elevation(built):
    arm = built("arm", "dof=2")
    mean = arm.shoulder + np.array([0.3, 0.0, 0.0])
    raised = arm.shoulder + 0.5 * np.array([np.cos(0.2), 0.0, np.sin(0.2)])
    score = score_source(mean, 1e-4 * np.eye(3), raised, arm)
    assert score.dimension == 2 and score.bearing_error_deg == pytest.approx(np.degrees(0.2))
    farther = score_source(mean, 1e-4 * np.eye(3), arm.shoulder + 2.0 * (raised - arm.shoulder), arm)
    assert farther.bearing_error_deg == pytest.approx(score.bearing_error_deg) and farther.nees == pytest.approx(score.nees)


def test_behind_the_base_azimuth_goes_the_short_way(built):
    arm = built("arm", "dof=1")
    a, b = (arm.shoulder + np.array([-0.3 * np.cos(x), 0.3 * np.sin(x), 0.0]) for x in (0.05, -0.05))
    assert score_source(a, np.eye(3), b, arm).bearing_error_deg == pytest.approx(np.degrees(0.1))


def test_rms():
    assert rms([3.0, 4.0]) == pytest.approx(np.sqrt(12.5)) and rms([]) is None
