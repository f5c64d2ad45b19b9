"""Intervals of a fitted curve hold the truth, and correlated residuals count as fewer."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from oio.identification.curve_fit import effective_size, fit_curve

T_S = np.linspace(0.0, 10.0, 80)


def line(p, t):
    return p[0] + p[1] * t


def test_white_residuals_count_whole_and_correlated_ones_by_their_correlation_time():
    white = np.random.default_rng(0).standard_normal(4000)
    assert effective_size(white) > 3000
    assert effective_size(lfilter([1.0], [1.0, -0.8], white)) == pytest.approx(4000 / 9.0, rel=0.3)
    assert effective_size(np.zeros(10)) == 10


@given(st.floats(-5, 5), st.floats(-5, 5), st.integers(0, 2**32 - 1))
def test_a_line_is_fitted_as_by_least_squares(offset, slope, seed):
    value = line((offset, slope), T_S) + np.random.default_rng(seed).standard_normal(80)
    wide = np.full(2, 100.0)
    fit = fit_curve(line, T_S, value, [np.zeros(2), np.ones(2)], -wide, wide)
    np.testing.assert_allclose(fit.parameters, np.polyfit(T_S, value, 1)[::-1], atol=1e-6)


def test_the_intervals_hold_the_truth():
    rng, wide, inside = np.random.default_rng(1), np.full(2, 100.0), []
    for _ in range(200):
        fit = fit_curve(line, T_S, line((1.0, 2.0), T_S) + rng.standard_normal(80), [np.zeros(2)], -wide, wide)
        inside.append(abs(fit.parameters - [1.0, 2.0]) < fit.half_widths)
    assert np.all(np.mean(inside, axis=0) > 0.88)


def test_noise_alone_rarely_stands_out():
    rng, wide, found = np.random.default_rng(2), np.full(2, 100.0), 0
    for _ in range(200):
        noise = rng.standard_normal(80)
        found += fit_curve(line, T_S, noise, [np.zeros(2)], -wide, wide).stands_out(noise)
    assert found <= 8
    assert fit_curve(line, T_S, T_S, [np.zeros(2)], -wide, wide).stands_out(T_S - T_S.mean())
