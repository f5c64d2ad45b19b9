"""Gains with errors in both elements are unbiased where least squares is not, and averages are worth what the theory of variances says."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.core.errors import NotObservable
from oio.identification.twin_elements import average_is_worse, averaging, relation


def twins(rng, gain=1.3, offset=20.0, noise=1.0, n=400):
    truth = 50.0 + 4.0 * np.sin(np.linspace(0.0, 30.0, n))
    return truth + noise * rng.standard_normal(n), gain * truth + offset + gain * noise * rng.standard_normal(n)


def test_the_intervals_hold_the_truth_and_the_gain_is_not_diluted():
    rng, inside, gains, diluted = np.random.default_rng(0), [], [], []
    for _ in range(100):
        first, other = twins(rng, noise=2.0)
        found = relation(first, other, noise_ratio=1.3**2)
        inside.append(
            (abs(found.gain - 1.3) < found.gain_half_width, abs(found.offset - (0.3 * found.at + 20.0)) < found.offset_half_width)
        )
        gains.append(found.gain)
        diluted.append(np.polyfit(first, other, 1)[0])
    assert np.all(np.mean(inside, axis=0) > 0.88), np.mean(inside, axis=0)
    assert np.mean(gains) == pytest.approx(1.3, abs=0.02) and np.mean(diluted) < 1.1


@given(st.floats(0.2, 5.0), st.floats(-50.0, 50.0))
def test_without_noise_the_relation_is_exact_and_its_inverse_the_inverse(gain, offset):
    first, other = twins(np.random.default_rng(1), gain, offset, noise=0.0)
    there, back = relation(first, other), relation(other, first)
    assert there.gain == pytest.approx(gain) and there.offset == pytest.approx(other.mean() - first.mean(), abs=1e-6)
    assert there.gain * back.gain == pytest.approx(1.0)


def test_a_gas_that_does_not_vary_has_no_gain():
    rng = np.random.default_rng(2)
    with pytest.raises(NotObservable, match="hardly varied"):
        relation(rng.standard_normal(100), rng.standard_normal(100))
    with pytest.raises(NotObservable, match="too few"):
        relation(np.arange(10.0), np.arange(10.0))


def test_averaging_helps_equal_twins_and_only_without_offsets_those_that_have_some():
    rng = np.random.default_rng(3)
    truth = np.linspace(0.0, 10.0, 4000)
    a, b = truth + rng.standard_normal(4000), truth + rng.standard_normal(4000)
    equal, apart = averaging(a, b, truth), averaging(a, b + 8.0, truth)
    assert equal.helps and equal.average == pytest.approx(np.sqrt(0.5), rel=0.05)
    assert not apart.helps and apart.helps_no_offset
    assert apart.average_no_offset == pytest.approx(equal.average_no_offset)


@pytest.mark.parametrize("ratio", [1.5, 2.9, 3.1, 9.0])
def test_the_average_is_worse_once_one_variance_is_three_times_the_other(ratio):
    rng = np.random.default_rng(4)
    a, b = rng.standard_normal(40_000), np.sqrt(ratio) * rng.standard_normal(40_000)
    assert average_is_worse(1.0, ratio) == average_is_worse(ratio, 1.0) == (ratio > 3.0)
    assert averaging(a, b, np.zeros(40_000)).helps == (ratio < 3.0)
