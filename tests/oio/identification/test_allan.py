"""The Allan deviation against allantools, its slopes for white noise, random walk and ramp, and how often its interval holds the truth."""

import allantools
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.identification.allan import FLICKER, RANDOM_WALK, WHITE, allan_curve, degrees_of_freedom, noise_exponent, octaves
from oio.identification.regular_series import regular


def series(value, period_s=0.5):
    return regular(period_s * np.arange(len(value)), np.asarray(value))


def slope(curve, start=0):
    return np.polyfit(np.log(curve.tau_s[start:]), np.log(curve.deviation[start:]), 1, w=np.sqrt(curve.edf[start:]))[0]


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.1, 1.0, 10.07]))
def test_the_deviation_is_that_of_allantools(seed, period_s):
    value = np.random.default_rng(seed).standard_normal(300)
    curve = allan_curve(series(value, period_s))
    tau_s, deviation, _, _ = allantools.oadev(value, rate=1.0 / period_s, data_type="freq", taus=curve.tau_s)
    np.testing.assert_allclose(curve.tau_s, tau_s, rtol=1e-9)
    np.testing.assert_allclose(curve.deviation, deviation, rtol=1e-9)


@pytest.mark.parametrize("alpha", [WHITE, FLICKER, RANDOM_WALK])
def test_the_degrees_of_freedom_are_those_of_allantools(alpha):
    """But of flicker at one period, where allantools lacks the square of SP 1065, table 5, and finds 1 for any length."""
    m = octaves(1000)[alpha == FLICKER :]
    told = [allantools.edf_simple(1001, int(factor), alpha) for factor in m]
    np.testing.assert_allclose(degrees_of_freedom(1001, m, np.full(len(m), alpha)), told)


@pytest.mark.parametrize("alpha", [WHITE, FLICKER, RANDOM_WALK])
def test_the_noise_is_told_from_its_autocorrelation(alpha):
    white = np.random.default_rng(1).standard_normal(4096)
    spectrum = np.fft.rfft(white) / np.maximum(np.fft.rfftfreq(4096), 1.0 / 4096) ** (-0.5 * alpha)
    value = np.fft.irfft(spectrum)
    assert noise_exponent(value) == alpha == allantools.autocorr_noise_id(value, 1, data_type="freq")[0]


def test_white_noise_falls_by_one_half_a_walk_rises_by_one_half_a_ramp_by_one():
    white = np.random.default_rng(2).standard_normal(20_000)
    assert slope(allan_curve(series(white))) == pytest.approx(-0.5, abs=0.02)
    assert slope(allan_curve(series(np.cumsum(white))), start=2) == pytest.approx(0.5, abs=0.05)
    ramp = allan_curve(series(3.0 * np.arange(1000)))
    np.testing.assert_allclose(ramp.deviation, 6.0 * ramp.tau_s / np.sqrt(2.0))  # 3 per half second


def test_the_interval_holds_the_truth_of_white_noise():
    """sigma = 1 / sqrt(m) at averaging factor m, in 95 % of 300 records, at every tau."""
    rng = np.random.default_rng(3)
    curves = [allan_curve(series(rng.standard_normal(400), 1.0)) for _ in range(300)]
    inside = np.mean([(c.low < c.tau_s**-0.5) & (c.tau_s**-0.5 < c.high) for c in curves], axis=0)
    assert np.all(inside > 0.9), inside


@given(st.floats(1e-3, 1e3), st.floats(-1e3, 1e3))
def test_a_unit_scales_the_curve_and_an_offset_does_nothing(scale, offset):
    value = np.random.default_rng(4).standard_normal(200)
    here, there = allan_curve(series(value)), allan_curve(series(scale * value + offset))
    np.testing.assert_allclose(there.deviation, scale * here.deviation, rtol=1e-6)


@pytest.mark.parametrize("n", [16, 100, 22768])
def test_the_longest_tau_is_at_most_a_fifth_of_the_record(n):
    curve = allan_curve(series(np.random.default_rng(5).standard_normal(n)))
    assert 0.1 * n * 0.5 < curve.longest_tau_s <= 0.2 * n * 0.5


def test_readings_that_never_change_have_no_deviation():
    assert np.all(allan_curve(series(np.full(100, 7.0))).deviation == 0.0)
