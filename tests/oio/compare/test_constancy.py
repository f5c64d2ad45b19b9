"""Welch's test of k values, and the joint test of vectors: laws, and Student's t where k is two."""

import numpy as np
import pytest
from scipy import stats

from oio.compare.constancy import constancy, joint_chi2

KNOWN = np.full(2, np.inf)


def test_equal_values_give_exactly_zero():
    found = constancy(np.full(3, 0.1), np.array([0.1, 0.7, 1e-8]), np.array([3.0, np.inf, 9.0]))
    assert (found.chi2, found.normal_chi2, found.trend_sd, found.p) == (0.0, 0.0, 0.0, 1.0)


def test_two_values_with_known_uncertainties_are_a_normal_difference():
    found = constancy(np.array([1.0, 1.6]), np.array([0.3, 0.4]), KNOWN)
    assert found.trend_sd == pytest.approx(0.6 / 0.5) and found.chi2 == pytest.approx(1.2**2) == found.normal_chi2
    assert found.p == pytest.approx(2 * stats.norm.sf(1.2))


def test_two_values_with_few_degrees_of_freedom_are_welchs_t():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=4), rng.normal(1.0, 3.0, size=7)
    u = np.array([a.std(ddof=1) / 2, b.std(ddof=1) / np.sqrt(7)])
    found = constancy(np.array([a.mean(), b.mean()]), u, np.array([3.0, 6.0]))
    expected = stats.ttest_ind(b, a, equal_var=False)
    assert found.trend_sd == pytest.approx(expected.statistic) and found.p == pytest.approx(expected.pvalue)
    assert stats.chi2.sf(found.normal_chi2, 1) == pytest.approx(found.p)
    assert found.normal_chi2 < found.chi2


def test_swapping_two_changes_the_sign_alone():
    a, b = constancy(np.array([1.0, 2.0]), np.array([0.3, 0.1]), KNOWN), constancy(np.array([2.0, 1.0]), np.array([0.1, 0.3]), KNOWN)
    assert a.trend_sd == pytest.approx(-b.trend_sd) and a.chi2 == pytest.approx(b.chi2) and a.p == pytest.approx(b.p)


@pytest.mark.parametrize("dof", [np.inf, 4.0])
def test_constants_are_rejected_as_often_as_p_says(dof):
    rng = np.random.default_rng(1)
    p = []
    for _ in range(2000):
        s = np.sqrt(rng.chisquare(dof, 4) / dof) if np.isfinite(dof) else np.ones(4)
        p.append(constancy(rng.normal(size=4), s, np.full(4, dof)).p)
    assert 0.03 < np.mean(np.array(p) < 0.05) < 0.07


def test_a_straight_line_is_a_trend():
    values, u = np.array([1.0, 2.0, 3.0, 4.0]), np.full(4, 0.5)
    assert constancy(values, u, np.full(4, np.inf)).trend_sd == pytest.approx(1.0 / (0.5 / np.sqrt(5.0)))  # slope over u / sqrt(Sxx)
    assert constancy(values[::-1], u, np.full(4, np.inf)).trend_sd == pytest.approx(-np.sqrt(20.0))


def test_one_without_uncertainty_is_the_reference():
    found = constancy(np.array([0.0, 0.2]), np.array([0.0, 0.1]), KNOWN)
    assert found.trend_sd == pytest.approx(2.0) and found.chi2 == pytest.approx(4.0)


def test_without_degrees_of_freedom_nothing_can_be_told():
    found = constancy(np.array([1.0, 2.0]), np.array([0.1, 0.1]), np.array([0.0, 9.0]))
    assert found.p is None and found.normal_chi2 == 0.0


def test_two_vectors_are_apart_by_mahalanobis():
    rng = np.random.default_rng(2)
    roots = rng.normal(size=(2, 3, 3)) + 2 * np.eye(3)
    covs = roots @ roots.transpose(0, 2, 1)
    x = rng.normal(size=(2, 3))
    d = x[1] - x[0]
    assert joint_chi2(x, covs) == pytest.approx(d @ np.linalg.solve(covs[0] + covs[1], d))
    scale = np.array([1e6, 1.0, 1e-6])
    assert joint_chi2(x * scale, covs * np.outer(scale, scale)) == pytest.approx(joint_chi2(x, covs))
    assert joint_chi2(x[[0, 0]], covs) == 0.0
