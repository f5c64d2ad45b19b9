"""A whiff is gas that was there: not what an earlier sniff left in the sensor, whatever its lag and however it is sampled."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.core.records import GasReading, JointState, nanoseconds
from oio.gas.bouts import ElementBaseline
from oio.gas.detection import WhiffDetector

AIR_PPM, SIGMA_PPM, FALL_S = 2.0, 0.1, 5.0
HERE = np.zeros(3)
gaps = st.lists(st.floats(1e-3, 60.0), min_size=1, max_size=30)  # s from reading to reading
levels = st.floats(-1e3, 1e5)  # ppm above clean air
taus = st.floats(1e-2, FALL_S)


def whiff(elements=1, fall_s=FALL_S):
    return WhiffDetector((ElementBaseline(AIR_PPM, SIGMA_PPM, AIR_PPM, 100, 100.0),) * elements, fall_s)


def reading(t_s, signal_ppm, element=0):
    return GasReading(nanoseconds(t_s), element, AIR_PPM + signal_ppm, SIGMA_PPM)


def joints(t_s, q):
    return JointState(nanoseconds(t_s), np.asarray(q, dtype=float), np.zeros(3), np.zeros(3))


def decayed(nose, began_ppm, tau_s, times_s, begins):
    """Feed a pure decay; a move begins before the readings in `begins`. The freshest of all moves, in ppm."""
    freshest = 0.0
    for i, t_s in enumerate(times_s):
        if i in begins:
            nose.begin()
        nose.feed(joints(t_s, HERE))
        nose.feed(reading(t_s, began_ppm * math.exp(-t_s / tau_s)))
        freshest = max(freshest, nose.fresh * SIGMA_PPM)
    return freshest


@given(began=levels, tau=taus, waits=gaps, begins=st.sets(st.integers(0, 29)))
def test_a_sensor_that_only_decays_smells_nothing_fresh(began, tau, waits, begins):
    """From any level, as fast as fall_s or faster, sampled anyhow, in as many moves as one likes."""
    rounding = 1e-6 * max(abs(began), 1.0)  # times are whole nanoseconds
    assert decayed(whiff(), began, tau, np.cumsum(waits), begins) <= rounding


@given(began=st.floats(0.0, 20.0), waits=gaps, seed=st.integers(0, 10**6))
def test_noise_on_a_decay_is_all_that_is_fresh(began, waits, seed):
    """At most the highest noise of a reading above the lowest of those that were left."""
    nose, noise, t_s = whiff(), SIGMA_PPM * np.random.default_rng(seed).standard_normal(len(waits) + 1), 0.0
    nose.feed(reading(0.0, began + noise[0]))
    nose.begin()
    for wait, more in zip(waits, noise[1:], strict=True):
        t_s += wait
        nose.feed(reading(t_s, began * math.exp(-t_s / FALL_S) + more))
    assert nose.fresh * SIGMA_PPM <= max(np.max(noise[1:]), 0.0) + max(-noise[0], 0.0) + 1e-6


@given(began=st.floats(0.0, 1e4), tau=taus, waits=gaps, step=st.floats(0.1, 1e4), data=st.data())
def test_a_step_of_gas_during_the_move_is_fresh(began, tau, waits, step, data):
    """As much of it as the sensor shows above the slowest decay, were it clean air: the sensor here is as slow as a sensor may be."""
    nose, times_s, f = whiff(), np.cumsum(waits), began
    comes = data.draw(st.integers(0, len(waits) - 1))
    nose.feed(reading(0.0, began))
    nose.begin()
    for i, wait in enumerate(waits):
        gas = step if i >= comes else 0.0
        f = gas + (f - gas) * math.exp(-wait / FALL_S)
        nose.feed(joints(times_s[i], HERE))
        nose.feed(reading(times_s[i], f))
    shown = step * (1.0 - math.exp(-(times_s[-1] - (times_s[comes] - waits[comes])) / FALL_S))
    assert nose.fresh * SIGMA_PPM >= 0.999 * shown - 1e-6 * max(began, step)


@given(signals=st.lists(levels, min_size=2, max_size=20), waits=st.lists(st.floats(0.01, 10.0), min_size=20, max_size=20))
def test_what_is_fresh_rose_somewhere(signals, waits):
    """A move that smelt knows where."""
    nose = whiff()
    for i, signal in enumerate(signals):
        t_s = sum(waits[: i + 1])
        nose.feed(joints(t_s, [i, 0.0, 0.0]))
        nose.feed(reading(t_s, signal))
    assert nose.q is not None or nose.fresh <= 1e-6 * max(map(abs, signals)) / SIGMA_PPM


@given(rises=st.permutations([1.0, 2.0, 4.0, 8.0, 16.0]))
def test_q_is_where_the_signal_rose_most(rises):
    nose, signal = whiff(fall_s=1e9), 0.0
    nose.feed(reading(0.0, 0.0))
    nose.begin()
    for i, rise in enumerate(rises):
        signal += rise
        nose.feed(joints(i + 1.0, [i, 0.0, 0.0]))
        nose.feed(reading(i + 1.0, signal))
    np.testing.assert_array_equal(nose.q, [rises.index(16.0), 0.0, 0.0])


def test_a_rise_against_the_decay_counts_from_the_decay():
    """A signal that stands still where it should have fallen by half rose by half of it."""
    nose = whiff(fall_s=1.0 / math.log(2.0))
    nose.feed(reading(0.0, 8.0))
    nose.begin()
    for t_s, signal, at in ((1.0, 4.0, 1.0), (2.0, 4.0, 2.0), (3.0, 3.0, 3.0)):
        nose.feed(joints(t_s, [at, 0.0, 0.0]))
        nose.feed(reading(t_s, signal))
    assert nose.q[0] == 2.0 and nose.fresh == pytest.approx((4.0 - 2.0) / SIGMA_PPM)


@given(elements=st.integers(1, 2), smells=st.lists(st.booleans(), min_size=2, max_size=12))
def test_memory_spans_the_moves(elements, smells):
    """One reading a move, of either element in turn: a move is fresh if and only if its element smelt more than was left of its last."""
    nose, signal = whiff(elements), [1.0] * elements
    for e in range(elements):
        nose.feed(reading(float(e), 1.0, e))
    for i, smell in enumerate(smells):
        t_s, e = elements + float(i), i % elements
        signal[e] = signal[e] + 5.0 if smell else signal[e] * math.exp(-elements / FALL_S)
        nose.begin()
        nose.feed(joints(t_s, [i, 0.0, 0.0]))
        nose.feed(reading(t_s, signal[e], e))
        assert (nose.fresh > 1.0) == smell
        assert nose.q is not None and nose.q[0] == i if smell else nose.fresh <= 1e-6


def test_the_first_reading_ever_is_no_whiff_but_no_silence_either():
    """What was there before is not known."""
    nose = whiff()
    nose.feed(joints(0.0, HERE))
    nose.feed(reading(0.0, 50.0))
    assert nose.fresh == 0.0 and nose.q is None and nose.level == pytest.approx(50.0 / SIGMA_PPM)


@given(signals=st.lists(levels, min_size=1, max_size=10))
def test_level_is_the_highest_of_the_move_above_clean_air(signals):
    nose = whiff()
    nose.feed(reading(0.0, 1e6))
    nose.begin()
    for i, signal in enumerate(signals):
        nose.feed(reading(1.0 + i, signal))
    assert nose.level == pytest.approx(max(0.0, *signals) / SIGMA_PPM)


def test_ppm_is_the_mean_of_the_elements_last_signals():
    nose = whiff(2)
    assert nose.ppm == 0.0
    for t_s, signal, element in ((0.0, 9.0, 0), (1.0, 2.0, 1), (2.0, 4.0, 0)):
        nose.feed(reading(t_s, signal, element))
    assert nose.ppm == pytest.approx(3.0)


def test_without_joints_a_whiff_has_no_place():
    nose = whiff()
    nose.feed(reading(0.0, 0.0))
    nose.feed(reading(1.0, 9.0))
    assert nose.fresh > 0.0 and nose.q is None
