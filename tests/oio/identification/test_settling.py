"""The time constant of a warm-up is within its interval; what has not settled, or never had to, is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from oio.core.errors import NotObservable
from oio.identification.settling import settling

T_S = np.arange(0.0, 60.0, 0.5)


@given(st.floats(3.0, 20.0), st.sampled_from([-8.0, 8.0]), st.floats(-100, 100), st.floats(1e-3, 1e3))
def test_a_clean_decay_is_found_exactly(tau_s, height, level, unit):
    found = settling(T_S + 50.0, unit * (level + height * np.exp(-T_S / tau_s)))
    assert found.tau_s == pytest.approx(tau_s, rel=1e-3)
    assert found.level == pytest.approx(unit * level, abs=0.02 * unit) and found.height == pytest.approx(unit * height, rel=1e-3)


def test_the_interval_holds_the_truth():
    rng, inside = np.random.default_rng(0), []
    for _ in range(80):
        noise = lfilter([0.8], [1.0, -0.6], rng.standard_normal(len(T_S)))
        found = settling(T_S, 3.0 + 8.0 * np.exp(-T_S / 12.0) + 0.3 * noise)
        inside.append(found.tau_low_s < 12.0 < found.tau_high_s)
    assert np.mean(inside) > 0.85


def test_what_does_not_settle_is_refused():
    rng = np.random.default_rng(1)
    with pytest.raises(NotObservable, match="no approach"):
        settling(T_S, rng.standard_normal(len(T_S)))
    with pytest.raises(NotObservable, match="no approach"):
        settling(T_S, np.full(len(T_S), 5.0))
    with pytest.raises(NotObservable, match="not settled within"):
        settling(T_S, np.exp(-T_S / 300.0) + 1e-4 * rng.standard_normal(len(T_S)))
    with pytest.raises(NotObservable, match="too few"):
        settling(T_S[:5], T_S[:5])
