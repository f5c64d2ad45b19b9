"""Eq. (2) and (3), and what both assemblies make of them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.inference.uncertainty import STATIC_SOURCE_Q_M2_S, Noise, assemble_q_r, type_a, type_b, type_b_of_repeats


def test_equations_2_and_3_by_hand():
    assert type_a(6.0, 9) == 2.0
    assert type_b(0.03, 4) == pytest.approx(0.03)
    assert type_b(0.03, 16) == pytest.approx(0.015)


@given(st.floats(1e-6, 1e6), st.integers(1, 1000))
def test_four_times_the_readings_halve_both(value, n):
    assert type_a(value, 4 * n) == pytest.approx(type_a(value, n) / 2)
    assert type_b(value, 4 * n) == pytest.approx(type_b(value, n) / 2)


def test_u_a_is_the_spread_of_means():
    rng = np.random.default_rng(0)
    means = rng.normal(0.0, 3.0, (20_000, 7)).mean(axis=1)
    assert np.std(means) == pytest.approx(type_a(3.0, 7), rel=0.03)


def of_repeats(misses_m, nees, moves, trace_m2=0.0):
    """Type B of repeats whose fits all have a covariance of this trace [m^2]."""
    return type_b_of_repeats(misses_m, nees, moves, np.full(len(misses_m), trace_m2))


def test_localisation_of_repeats():
    b = of_repeats(np.array([0.01, 0.03]), np.array([3.0, 9.0]), moves=(4, 4))
    assert b.u_b_m == pytest.approx((0.01 + 0.03) / 2)  # 2 v / sqrt(4) = v
    assert b.rms_m == pytest.approx(np.sqrt((0.01**2 + 0.03**2) / 2))
    assert b.inflation == pytest.approx(2.0 * 6 / 4)  # mean NEES 6 where 3 was expected, by 6 degrees of freedom
    assert b.misses_m == (0.01, 0.03) and b.moves == (4, 4)
    assert of_repeats(np.array([0.01, 0.01]), np.array([1.0, 1.0]), (4, 4)).inflation == pytest.approx(6 / 4)  # luck narrows nothing


def test_every_repeat_counts_its_own_moves():
    b = of_repeats(np.array([0.01, 0.03]), np.array([3.0, 3.0]), moves=(4, 9))
    assert b.u_b_m == pytest.approx((2 * 0.01 / 2 + 2 * 0.03 / 3) / 2)


@given(st.lists(st.floats(0.0, 1e3), min_size=1, max_size=20))
def test_inflation_widens_and_the_more_the_fewer_repeats_say_so(nees):
    once, twice = (of_repeats(np.full(n * len(nees), 0.01), np.array(n * nees), (4,) * n * len(nees)).inflation for n in (1, 2))
    assert once > twice > max(1.0, float(np.mean(nees)) / 3.0)


@pytest.mark.parametrize("repeats", [2, 4, 10])
def test_the_next_miss_is_what_the_inflated_covariance_says(repeats):
    """Misses of covariances 100 times too small: NEES over the estimate is F(3, nu), whose mean is nu / (nu - 2) and not 1."""
    rng = np.random.default_rng(1)
    seen, coming = 100.0 * rng.chisquare(3, (40_000, repeats)), 100.0 * rng.chisquare(3, 40_000)
    inflation = np.array([of_repeats(np.full(repeats, 0.01), nees, (4,) * repeats).inflation for nees in seen])
    assert np.mean(coming / inflation) == pytest.approx(3.0, rel=0.04)


def test_the_paper_puts_both_on_the_diagonals_as_they_stand():
    b = of_repeats(np.array([0.02]), np.array([6.0]), moves=(4,))
    assert assemble_q_r("paper", 0.7, b) == Noise("paper", source_q_m2=b.u_b_m, r_ppm2=0.7, source_p0_m2=0.0, measurements=1, inflation=1.0)


def test_gum_puts_type_b_into_the_beginning_and_a_fresh_reading_into_r():
    b = of_repeats(np.array([0.02]), np.array([6.0]), moves=(4,))
    noise = assemble_q_r("gum", 0.7, b)
    assert noise.r_ppm2 is None and noise.source_q_m2 == STATIC_SOURCE_Q_M2_S
    assert 3.0 * noise.source_p0_m2 == pytest.approx(0.02**2)  # fits that claim no error explain none
    assert noise.inflation == pytest.approx(2.0 * 3 / 1) and noise.measurements == 5  # four moves are five measurements


@pytest.mark.parametrize(("trace_m2", "left_m2"), [(0.01**2, 0.02**2 - 3.0 * 0.01**2), (0.02**2, 0.0)])
def test_gum_adds_of_type_b_only_what_the_repeats_covariances_do_not_explain(trace_m2, left_m2):
    """A map has a covariance of its own; the whole mean square on top of it would count the same error twice."""
    b = of_repeats(np.array([0.02]), np.array([3.0]), moves=(4,), trace_m2=trace_m2)
    assert b.inflation == pytest.approx(3.0)  # by the few degrees of freedom of one repeat
    assert 3.0 * assemble_q_r("gum", 0.7, b).source_p0_m2 == pytest.approx(left_m2, abs=1e-12)
