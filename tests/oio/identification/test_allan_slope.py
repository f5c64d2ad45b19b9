"""The slope at the longest tau is that of the noise that is there, and a record that cannot tell is refused."""

import numpy as np
import pytest

from oio.core.errors import NotObservable
from oio.identification.allan_slope import end_slope

T_S = 0.5 * np.arange(1200)
NOISES = {
    "white": (lambda rng: rng.standard_normal(1200), -0.5, 0.2),
    "walk": (lambda rng: np.cumsum(rng.standard_normal(1200)), 0.49, 0.94),
    "ramp": (lambda rng: 0.02 * T_S + 0.1 * rng.standard_normal(1200), 0.98, 1.0),
}


@pytest.mark.parametrize("name", NOISES)
def test_each_noise_has_its_slope(name):
    draw, low, high = NOISES[name]
    for seed in range(20):
        found = end_slope(T_S, draw(np.random.default_rng(seed)))
        assert low - 1e-9 <= found.slope <= high, (seed, found)
        assert found.tau_s == 64.0 and found.span_s == 600.0


def test_a_ramp_has_its_drift():
    found = end_slope(T_S, NOISES["ramp"][0](np.random.default_rng(0)))
    assert found.drift_per_s == pytest.approx(0.02, rel=0.05)


@pytest.mark.parametrize("value", [np.zeros(1200), np.arange(10.0)])
def test_a_record_that_cannot_tell_is_refused(value):
    with pytest.raises(NotObservable):
        end_slope(T_S[: len(value)], value)
