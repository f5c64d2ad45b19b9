"""A noisy element is flagged and the others are not; drift raises the threshold but not the noise."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.core.errors import NotObservable
from oio.identification.element_noise import element_noise


@given(st.integers(3, 20), st.integers(0, 2**32 - 1), st.floats(1e-3, 1e3))
def test_the_noisy_one_alone_is_flagged_in_any_unit(m, seed, unit):
    value = np.random.default_rng(seed).standard_normal((300, m)) * unit
    value[:, m // 2] *= 20.0
    assert [e.noisy for e in element_noise(value)] == [i == m // 2 for i in range(m)]


def test_noise_and_threshold_by_hand():
    rng = np.random.default_rng(0)
    (still,), (drifting,) = (element_noise(2.0 * rng.standard_normal((5000, 1)) + ramp * np.arange(5000)[:, None]) for ramp in (0.0, 0.01))
    assert still.sigma == pytest.approx(2.0, rel=0.05) and still.threshold == pytest.approx(6.0, rel=0.05)
    assert drifting.sigma == pytest.approx(2.0, rel=0.05) and drifting.threshold > 30.0


def test_two_elements_cannot_outvote_each_other_and_few_readings_say_nothing():
    value = np.random.default_rng(1).standard_normal((100, 2)) * [1.0, 50.0]
    assert not any(e.noisy for e in element_noise(value))
    with pytest.raises(NotObservable, match="16 are needed"):
        element_noise(value[:10])
