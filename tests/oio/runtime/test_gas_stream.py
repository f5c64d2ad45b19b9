"""Gaps in the stream of gas samples."""

import copy
import itertools

from hypothesis import given
from hypothesis import strategies as st

from oio.runtime.gas_stream import GasStream, StreamGaps


def stream(times_ns):
    gas = GasStream()
    for t_ns in times_ns:
        gas.arrived(t_ns)
    return gas


def test_without_two_samples_nothing_is_due():
    assert stream([]).gaps() == stream([5]).gaps() == StreamGaps(0, 0, 0.0, 0.0, 0.0)


@given(st.integers(4, 200), st.integers(1, 10**10), st.sets(st.integers(1, 198)))
def test_missing_samples_are_counted(n, period_ns, lost):
    kept = [i for i in range(n) if i not in lost or i == n - 1]
    gaps = stream([i * period_ns for i in kept]).gaps()
    if 2 * len(kept) > n + 2:  # most intervals are whole
        assert (gaps.due, gaps.missing) == (n, n - len(kept))
        assert gaps.interval_s == period_ns / 1e9
        assert gaps.longest_s == max(b - a for a, b in itertools.pairwise(kept)) * period_ns / 1e9


def test_jitter_is_no_gap_and_a_copy_goes_on_alone():
    gas = stream([0, 100, 205, 290, 410])
    other = copy.deepcopy(gas)
    other.arrived(1000)
    assert gas.gaps().missing == 0 and other.gaps().missing == 5


def test_the_stream_that_stops_first_is_told():
    gas = stream([0, 10**9, 2 * 10**9])
    assert gas.gaps().joints_after_s == 0.0  # no joints at all, as at a fixed mount before it was asked
    gas.joints_arrived(5_100_000_000)
    assert gas.gaps().joints_after_s == 3.1
    gas.arrived(7 * 10**9)
    assert gas.gaps().joints_after_s == -1.9
    alone = stream([])
    alone.joints_arrived(10**9)
    assert alone.gaps() == StreamGaps(0, 0, 0.0, 0.0, 0.0)
