"""Rise and fall of a first-order lag are found within their intervals, and readings without a step are refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from oio.core.errors import NotObservable
from oio.identification.step_response import step_response

T_S = np.arange(0.0, 60.0, 0.5)


def lagged(tau_s=3.0, onset_s=20.7, height=5.0, level=10.0):
    return level - height * np.expm1(-np.maximum(T_S - onset_s, 0.0) / tau_s)


@given(st.floats(1.0, 8.0), st.floats(10.0, 25.0), st.sampled_from([-5.0, 5.0]), st.floats(1e-3, 1e3))
def test_a_clean_step_is_found_exactly(tau_s, onset_s, height, unit):
    found = step_response(T_S + 100.0, unit * lagged(tau_s, onset_s, height), gas_s=109.0)
    assert found.tau_s == pytest.approx(tau_s, rel=1e-3) and found.dead_s == pytest.approx(onset_s - 9.0, abs=0.02)
    assert found.height == pytest.approx(unit * height, rel=1e-3) and found.rises == (height > 0)
    assert found.t63_s == pytest.approx(tau_s, rel=1e-3) and found.t90_s == pytest.approx(2.302585 * tau_s, rel=1e-3)


@pytest.mark.parametrize(("rho", "least"), [(0.0, 0.9), (0.7, 0.8)])
def test_the_intervals_hold_the_truth(rho, least):
    """In white noise in 95 %, in noise that is correlated over a few readings in somewhat fewer."""
    rng, inside = np.random.default_rng(0), []
    for _ in range(80):
        noise = lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], rng.standard_normal(len(T_S)))
        found = step_response(T_S, lagged() + 0.2 * noise, gas_s=20.0)
        inside.append((found.tau_low_s < 3.0 < found.tau_high_s, abs(found.dead_s - 0.7) < found.onset_half_width_s))
    assert np.all(np.mean(inside, axis=0) >= (least, 0.75)), np.mean(inside, axis=0)


def test_without_the_time_of_the_gas_there_is_no_dead_time():
    assert step_response(T_S, lagged()).dead_s is None


@pytest.mark.parametrize("made", ["noise", "constant", "ramp"])
def test_what_is_no_step_is_refused(made):
    noise = np.random.default_rng(1).standard_normal(len(T_S))
    value = {"noise": noise, "constant": np.full(len(T_S), 4.0), "ramp": 0.1 * T_S + noise}[made]
    with pytest.raises(NotObservable, match="no step stands out"):
        step_response(T_S, value)


def test_what_the_record_cannot_tell_is_said():
    with pytest.raises(NotObservable, match="time constant is longer"):
        step_response(T_S, lagged(tau_s=200.0, onset_s=30.0, height=50.0))
    with pytest.raises(NotObservable, match="over between two readings"):
        step_response(T_S, np.where(T_S < 30.0, 0.0, 1.0))
    with pytest.raises(NotObservable, match="too few"):
        step_response(T_S[:5], T_S[:5])
