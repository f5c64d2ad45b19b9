"""The delay of a known signal is found between samples, within its interval, and the same for the same seed."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.core.errors import NotObservable
from oio.identification.delay import delay

PERIOD_S = 0.5


def approach(delay_s=0.0, n=600, noise=0.0, rng=None):
    """Range of a nose that goes to and fro irregularly, and the reading of a source of 1 / r behind it."""
    t_s = PERIOD_S * np.arange(n)

    def range_m(t):
        return 0.3 + 0.1 * np.sin(0.35 * t) + 0.06 * np.sin(0.83 * t + 1.0)

    ppm = 1.0 / range_m(t_s - delay_s)
    return range_m(t_s), ppm * np.exp(noise * rng.standard_normal(n)) if rng else ppm


@given(st.floats(-3.0, 3.0))
def test_a_delay_is_found_between_samples(delay_s):
    found = delay(PERIOD_S, *approach(delay_s), 6.0, np.random.default_rng(0))
    assert found.delay_s == pytest.approx(delay_s, abs=0.1) and found.correlation > 0.9


def test_the_interval_holds_the_truth():
    rng, inside = np.random.default_rng(1), []
    for _ in range(60):
        found = delay(PERIOD_S, *approach(1.3, noise=0.3, rng=rng), 6.0, rng)
        inside.append(found.low_s - 0.05 <= 1.3 <= found.high_s + 0.05)
    assert np.mean(inside) > 0.85


def test_the_same_seed_gives_the_same_interval():
    a, b = (delay(PERIOD_S, *approach(1.0, noise=0.3, rng=np.random.default_rng(2)), 6.0, np.random.default_rng(3)) for _ in range(2))
    assert a == b


def test_units_do_not_matter():
    range_m, ppm = approach(1.0, noise=0.3, rng=np.random.default_rng(4))
    a, b = (delay(PERIOD_S, u * range_m, v * ppm, 6.0, np.random.default_rng(3)) for u, v in ((1.0, 1.0), (1000.0, 1e-3)))
    assert a.delay_s == pytest.approx(b.delay_s)


def test_what_cannot_be_told_is_refused():
    rng = np.random.default_rng(5)
    range_m, ppm = approach()
    for args, said in (
        ((range_m[:60], ppm[:60], 6.0), "too short"),
        ((np.ones(600), ppm, 6.0), "do not change"),
        ((range_m, -ppm, 6.0), "no reading is above clean air"),
        ((range_m, approach(3.0)[1], 1.0), "no peak within 1 s"),
    ):
        with pytest.raises(NotObservable, match=said):
            delay(PERIOD_S, *args, rng)
