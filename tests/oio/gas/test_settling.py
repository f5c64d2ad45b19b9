"""The time that a sensor still takes to settle, against the exponential that it is meant for."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from oio.gas.settling import settling_time


@given(st.floats(0.5, 500.0), st.floats(1.0, 1e3), st.floats(1e-3, 0.9), st.sampled_from([-1.0, 1.0]), st.integers(3, 50))
def test_an_exponential_settles_when_it_says(tau_s, slope, part, sign, n):
    t_s = np.linspace(0.0, 0.05 * tau_s, n)
    slopes = sign * slope * np.exp(-t_s / tau_s)
    allowed = part * slope * np.exp(-t_s[-1] / tau_s)
    assert np.isclose(settling_time(t_s, slopes, allowed), -tau_s * np.log(part), rtol=1e-6, atol=1e-6 * tau_s)


def test_what_has_settled_needs_no_time_and_what_does_not_decay_has_none():
    t_s = np.arange(4.0)
    assert settling_time(t_s, np.array([4.0, 3.0, 2.0, 0.1]), 0.5) == 0.0
    assert settling_time(t_s, np.array([1.0, 2.0, 3.0, 4.0]), 0.5) is None
    assert settling_time(t_s[:2], np.array([4.0, 2.0]), 0.5) is None
    assert settling_time(t_s, np.array([4.0, 0.0, 2.0, 1.0]), 0.5) is None


def test_a_decay_that_is_lost_in_the_scatter_is_not_extrapolated():
    rng, t_s = np.random.default_rng(3), np.arange(60.0)
    flat = -13.9 * np.exp(0.1 * rng.standard_normal(60) - 1e-5 * t_s)
    assert settling_time(t_s, flat, 4.0) is None
    decaying = -13.9 * np.exp(0.1 * rng.standard_normal(60) - t_s / 100.0)
    assert 20.0 < settling_time(t_s, decaying, 4.0) < 120.0  # 100 ln(13.9 / 4) - 59 = 66 s
