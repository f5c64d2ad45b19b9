"""A record is taken as it is, or what was done to it is said: nothing is lost, moved or made up silently."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.core.errors import NotObservable
from oio.identification.regular_series import regular


@given(st.integers(16, 200), st.floats(0.01, 100.0), st.floats(0.0, 0.45), st.integers(0, 2**32 - 1))
def test_jitter_below_half_a_period_changes_no_reading(n, period_s, jitter, seed):
    rng = np.random.default_rng(seed)
    t_s = np.cumsum(period_s * np.concatenate([[1.0], 1.0 + jitter * rng.uniform(-1.0, 1.0, n - 1)]))
    t_s[-1] = t_s[-2] + np.median(np.diff(t_s[:-1]))
    value = rng.standard_normal(n)
    series = regular(t_s, value)
    if 1.5 * series.period_s > (1.0 + jitter) * period_s and 0.5 * series.period_s < (1.0 - jitter) * period_s:
        np.testing.assert_array_equal(series.value, value)
        assert "interpolated" not in series.account and "averaged" not in series.account


def test_a_short_gap_is_filled_and_counted():
    t_s = np.delete(np.arange(40.0), [10, 11, 20])
    series = regular(t_s, 2.0 * t_s)
    np.testing.assert_allclose(series.value, 2.0 * np.arange(40.0))
    assert series.account == "40 readings every 1 s; 3 interpolated"


def test_a_long_gap_splits_and_the_longest_stretch_is_named():
    t_s = np.concatenate([np.arange(60.0), 60.0 + np.arange(40.0, 180.0)])
    series = regular(t_s, t_s)
    assert series.value[0] == 100.0 and len(series.value) == 140 and series.span_s == 140.0
    assert "2.32 of 3.98 min, from 100 s" in series.account


def test_bursts_are_averaged_into_one_reading():
    t_s = np.sort(np.concatenate([30.0 * np.arange(20.0), [95.0, 100.0]]))
    series = regular(t_s, np.where(t_s == 100.0, 4.0, 1.0))
    assert len(series.value) == 20 and series.value.max() == 2.0 and "2 averaged" in series.account


@pytest.mark.parametrize("t_s", [np.arange(15.0), np.cumsum(np.tile([1.0, 1.0, 9.0], 20))])
def test_too_little_is_refused(t_s):
    with pytest.raises(NotObservable, match="16 are needed"):
        regular(t_s, t_s)
