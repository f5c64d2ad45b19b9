"""The KPSS test rejects as often as its table says, and the trend's interval holds the truth of correlated noise."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.identification.hac import bandwidth, long_run_covariance, regression
from oio.identification.stationarity import CRITICAL, kpss, trend


def correlated(rng, n, rho=0.8):
    """First-order autoregressive noise of variance 1."""
    value = np.empty(n)
    value[0] = rng.standard_normal()
    for i, step in enumerate(np.sqrt(1.0 - rho**2) * rng.standard_normal(n - 1)):
        value[i + 1] = rho * value[i] + step
    return value


@pytest.mark.parametrize("about", ["level", "trend"])
def test_white_noise_exceeds_the_published_values_as_often_as_published(about):
    rng = np.random.default_rng(0)
    found = np.array([kpss(rng.standard_normal(400), about).statistic for _ in range(2000)])
    for share, critical in zip((0.10, 0.05, 0.025, 0.01), CRITICAL[about], strict=True):
        assert np.mean(found > critical) == pytest.approx(share, abs=0.02)


def test_a_walk_and_a_ramp_are_not_stationary_and_a_ramp_is_about_its_trend():
    rng = np.random.default_rng(1)
    white = rng.standard_normal(300)
    assert kpss(white).stationary and not kpss(np.cumsum(white)).stationary
    assert not kpss(white + 0.02 * np.arange(300)).stationary and kpss(white + 0.02 * np.arange(300), "trend").stationary


def test_correlated_noise_is_stationary_more_often_than_not():
    rng = np.random.default_rng(2)
    assert np.mean([kpss(correlated(rng, 300)).stationary for _ in range(200)]) > 0.85


def test_the_p_value_stays_within_the_table():
    assert kpss(np.full(50, 3.0)).p_value == 0.10 and kpss(np.arange(100.0)).p_value == 0.01


@given(st.floats(1e-3, 1e3), st.floats(-1e4, 1e4))
def test_neither_unit_nor_offset_matters(scale, offset):
    value = np.random.default_rng(3).standard_normal(60)
    assert kpss(scale * value + offset).statistic == pytest.approx(kpss(value).statistic, rel=1e-4)


@pytest.mark.parametrize("rho", [0.0, 0.8])
def test_the_interval_of_the_trend_holds_the_truth(rho):
    rng, t_s, inside = np.random.default_rng(4), 2.0 * np.arange(300), []
    for _ in range(300):
        found = trend(t_s, 0.01 * t_s + correlated(rng, 300, rho))
        inside.append(abs(found.slope - 0.01) <= found.half_width)
    assert np.mean(inside) > 0.87


def test_a_trend_that_is_none_vanishes():
    rng = np.random.default_rng(5)
    assert np.mean([trend(np.arange(100.0), rng.standard_normal(100)).vanishes for _ in range(200)]) > 0.88
    assert not trend(np.arange(100.0), 0.1 * np.arange(100.0) + rng.standard_normal(100)).vanishes


def test_without_lags_the_long_run_variance_is_the_variance():
    scores = np.random.default_rng(6).standard_normal((50, 2))
    np.testing.assert_allclose(long_run_covariance(scores, 0), scores.T @ scores / 50)


def test_the_bandwidth_grows_with_correlation():
    rng = np.random.default_rng(7)
    assert bandwidth(rng.standard_normal(500)) < bandwidth(correlated(rng, 500, 0.9))


def test_the_long_run_variance_of_correlated_noise_is_that_of_its_mean():
    """Of an autoregressive process of variance 1 it is (1 + rho) / (1 - rho): 9 times the variance at rho = 0.8."""
    rng = np.random.default_rng(8)
    found = [long_run_covariance(correlated(rng, 4000)[:, None], 60)[0, 0] for _ in range(20)]
    assert np.mean(found) == pytest.approx(9.0, rel=0.15)


def test_the_regression_is_least_squares():
    rng = np.random.default_rng(9)
    design, value = rng.standard_normal((40, 3)) * [1.0, 1e4, 1e-4], rng.standard_normal(40)
    np.testing.assert_allclose(regression(design, value)[0], np.linalg.lstsq(design, value, rcond=None)[0], rtol=1e-9)
