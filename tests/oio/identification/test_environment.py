"""Coefficients of temperature and humidity lie in their intervals, and are refused where the record cannot tell them."""

import numpy as np
import pytest
from scipy.signal import lfilter

from oio.core.errors import NotObservable
from oio.identification.environment import environment

T_S = np.arange(600.0)
TEMPERATURE, HUMIDITY = 22.0 + 3.0 * np.sin(T_S / 40.0), 40.0 + 5.0 * np.cos(T_S / 23.0)


def test_the_intervals_hold_the_truth_in_correlated_noise():
    rng, inside = np.random.default_rng(0), []
    for _ in range(100):
        noise = lfilter([0.6], [1.0, -0.8], rng.standard_normal(600))
        found = environment(400.0 + 2.0 * TEMPERATURE - 0.5 * HUMIDITY + noise, TEMPERATURE, HUMIDITY)
        inside.append((abs(found.per_degc - 2.0) < found.per_degc_half_width, abs(found.per_pct + 0.5) < found.per_pct_half_width))
    assert np.all(np.mean(inside, axis=0) > 0.85)


def test_a_clean_dependence_is_exact_and_explains_everything():
    found = environment(2.0 * TEMPERATURE - 0.5 * HUMIDITY, TEMPERATURE, HUMIDITY)
    assert (found.per_degc, found.per_pct, found.explained) == pytest.approx((2.0, -0.5, 1.0))


def test_what_cannot_be_told_is_refused():
    value = np.random.default_rng(1).standard_normal(600)
    for args, said in (
        ((value, TEMPERATURE, np.full(600, 40.0)), "did not change"),
        ((value, TEMPERATURE, 100.0 - TEMPERATURE), r"together \(r = -1.00\)"),
        ((value[:10], TEMPERATURE[:10], HUMIDITY[:10]), "too few"),
    ):
        with pytest.raises(NotObservable, match=said):
            environment(*args)
