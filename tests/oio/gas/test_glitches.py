"""Readings that a sensor with a lag cannot have given are found, and nothing else is."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oio.core.records import GasReading
from oio.gas.glitches import glitches

FALL_S, PERIOD_S, NOISE_PPM = 0.4, 0.1, 3.0
T_S = np.arange(0.0, 60.0, PERIOD_S)


def sensed(seed):
    """Gas that comes and goes in steps, as the sensor reads it."""
    rng = np.random.default_rng(seed)
    gas = np.repeat(rng.choice([0.0, 30.0, 400.0, 2000.0], 60), 10)
    ppm = np.zeros_like(gas)
    for i in range(1, len(gas)):
        tau_s = FALL_S * rng.uniform(0.5, 2.0)
        ppm[i] = ppm[i - 1] + (gas[i] - ppm[i - 1]) * (1.0 - np.exp(-PERIOD_S / tau_s))
    return 420.0 + ppm + NOISE_PPM * rng.standard_normal(len(gas))


def readings(ppm, element=0):
    return [GasReading(round(1e9 * t_s), element, float(value), NOISE_PPM) for t_s, value in zip(T_S, ppm, strict=True)]


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_no_gas_looks_like_a_glitch_even_with_half_the_lag(seed):
    assert not glitches(readings(sensed(seed)), FALL_S).any()


@pytest.mark.parametrize(
    ("where", "value"),
    [
        ([450], 2500.0), ([450], 0.0), ([100, 101, 200, 300, 305, 555], 3000.0),
        ([*range(450, 459)], 1500.0), ([450, 451, 452], 0.0), ([0], 2000.0),
    ],
)  # fmt: skip
def test_glitches_are_found(where, value):
    ppm = 420.0 + 30.0 * np.sin(T_S / 3.0) + NOISE_PPM * np.random.default_rng(1).standard_normal(len(T_S))
    ppm[where] = value
    assert np.flatnonzero(glitches(readings(ppm), FALL_S)).tolist() == where


def test_a_drop_beside_a_spike():
    ppm = 420.0 + NOISE_PPM * np.random.default_rng(1).standard_normal(len(T_S))
    ppm[450:452] = 0.0, 2500.0
    assert np.flatnonzero(glitches(readings(ppm), FALL_S)).tolist() == [450, 451]


def test_elements_are_looked_at_apart():
    both = [one for pair in zip(readings(sensed(1)), readings(sensed(2) + 900.0, 1), strict=True) for one in pair]
    assert not glitches(both, FALL_S).any()


@pytest.mark.parametrize("ppm", [np.where(T_S < 30.0, 900.0, 420.0), np.where(np.arange(len(T_S)) % 2, 900.0, 420.0)])
def test_a_step_of_the_baseline_is_kept_and_so_is_a_sensor_that_is_faster_than_said(ppm):
    assert not glitches(readings(ppm + NOISE_PPM * np.random.default_rng(1).standard_normal(len(T_S))), FALL_S).any()


@pytest.mark.parametrize("count", [0, 1, 2])
def test_few_readings(count):
    assert glitches(readings(np.full(len(T_S), 420.0))[:count], FALL_S).tolist() == [False] * count
