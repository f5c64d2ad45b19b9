"""A trace thins joints, keeps every reading with the joints of its time, and forgets the oldest."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.core.errors import NotObservable
from oio.core.records import GasReading, JointState, nanoseconds
from oio.gas.trace import Trace


def joints(t_s):
    return JointState(nanoseconds(t_s), [t_s, -t_s], [0.0, 0.0], [0.0, 0.0])


def reading(t_s, element=0):
    return GasReading(nanoseconds(t_s), element, 100.0 + t_s, 0.5)


def filled(period_s=0.1, limit=1000, ticks=100, every=7):
    trace = Trace(period_s, limit)
    for i in range(ticks):
        trace.add(joints(0.02 * i))
        if i % every == every - 1:
            trace.add(reading(0.02 * i, i % 2))
    return trace


def test_joints_that_stand_are_kept_ten_times_more_seldom():
    trace = Trace(0.1, 1000)
    for i in range(151):
        trace.add(JointState(nanoseconds(0.02 * i), [1.0], [0.0], [0.0]))
        if i in (0, 150):
            trace.add(reading(0.02 * i))
    np.testing.assert_allclose(trace.as_arrays().t_s, [0.0, 1.0, 2.0, 3.0])


def test_joints_are_thinned_and_every_reading_is_kept():
    trace = Trace(0.1, 1000)
    for i in range(101):
        trace.add(joints(0.02 * i))
        if i in (0, 100):
            trace.add(reading(0.02 * i))
    np.testing.assert_allclose(trace.as_arrays().t_s, 0.1 * np.arange(21))
    assert len(filled(ticks=100, every=7)) == 14


def test_the_path_begins_at_the_first_reading():
    sniffs = filled(every=7).as_arrays()
    assert sniffs.t_s[0] == sniffs.reading_t_s[0] == 0.12 and sniffs.at[0] == 0


def test_one_reading_is_no_trace():
    with pytest.raises(NotObservable, match="fewer than two readings"):
        filled(ticks=10, every=7).as_arrays()


@given(st.integers(1, 40), st.floats(0.02, 1.0))
def test_every_reading_has_the_joints_of_its_time(every, period_s):
    sniffs = filled(period_s, 1000, 120, every).as_arrays()
    np.testing.assert_allclose(sniffs.t_s[sniffs.at], sniffs.reading_t_s)
    np.testing.assert_allclose(sniffs.q[sniffs.at, 0], sniffs.reading_t_s)
    np.testing.assert_allclose(sniffs.ppm, 100.0 + sniffs.reading_t_s)
    assert np.all(np.diff(sniffs.t_s) > 0)


def test_a_reading_before_the_first_joints_is_dropped():
    trace = Trace(0.1, 100)
    trace.add(reading(0.0))
    trace.add(joints(0.02))
    trace.add(reading(0.02))
    trace.add(joints(0.04))
    trace.add(reading(0.04))
    assert len(trace) == 2 and trace.as_arrays().at.tolist() == [0, 1]


def test_the_oldest_go_first():
    trace = filled(period_s=0.02, limit=100, ticks=1000, every=2)
    sniffs = trace.as_arrays()
    assert len(sniffs.t_s) <= 100 and len(trace) <= 100
    np.testing.assert_allclose([sniffs.t_s[-1], sniffs.reading_t_s[-1]], 0.02 * 999)
    np.testing.assert_allclose(sniffs.t_s[sniffs.at], sniffs.reading_t_s)


def test_between_and_without_part_the_readings():
    sniffs = filled().as_arrays()
    inner, outer = sniffs.between(0.5, 1.2), sniffs.without(0.5, 1.2)
    assert len(inner.ppm) > 2 and len(inner.ppm) + len(outer.ppm) == len(sniffs.ppm)
    assert inner.t_s[0] == inner.reading_t_s[0] and inner.t_s[-1] <= 1.2
    assert sniffs.without(0.0, 1.2).reading_t_s[0] == sniffs.reading_t_s[0]  # where the lag begins
    np.testing.assert_allclose(inner.t_s[inner.at], inner.reading_t_s)
    np.testing.assert_allclose(inner.q[inner.at, 0], inner.reading_t_s)
    assert np.all((inner.reading_t_s >= 0.5) & (inner.reading_t_s <= 1.2))
    np.testing.assert_array_equal(outer.t_s, sniffs.t_s)  # the lag goes through the whole path
    np.testing.assert_allclose(outer.t_s[outer.at], outer.reading_t_s)
    assert not np.any((outer.reading_t_s >= 0.5) & (outer.reading_t_s <= 1.2))


@pytest.mark.parametrize("span", [(0.5, 0.5), (1.2, 0.5), (50.0, np.inf)])
def test_a_span_without_readings_is_refused_in_words(span):
    with pytest.raises(NotObservable, match=rf"no reading from {span[0]:.3f} to {span[1]:.3f} s; sniff longer"):
        filled().as_arrays().between(*span)
