"""N, K, B and R of simulated sensors lie in their intervals, B is reported for a floor alone, and a forecast is what comes true."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.core.errors import NotObservable
from oio.identification.allan import allan_curve
from oio.identification.allan_fit import birge_ratio, fit_allan, forecast_relative_u
from oio.identification.regular_series import regular

DT_S = 0.5


def record(rng, span_s, white=1.0, walk=0.0, ramp=0.0):
    """White noise N, random walk K and drift R of a sensor at 2 Hz."""
    n = round(span_s / DT_S)
    return (
        white / np.sqrt(DT_S) * rng.standard_normal(n)
        + np.cumsum(walk * np.sqrt(DT_S) * rng.standard_normal(n))
        + ramp * DT_S * np.arange(n)
    )


def fitted(value):
    return fit_allan(allan_curve(regular(DT_S * np.arange(len(value)), value)))


def flicker(rng, n):
    """Noise of spectrum 1 / f, whose Allan deviation is flat."""
    return np.fft.irfft(np.fft.rfft(rng.standard_normal(n)) / np.sqrt(np.maximum(np.fft.rfftfreq(n), 1.0 / n)), n)


@pytest.mark.parametrize(
    ("white", "walk", "span_s"), [(1.0, 0.0, 900), (1.0, 0.02, 900), (1.0, 0.02, 3600), (0.5, 1.0, 900), (1.0, 0.0, 90)]
)
def test_the_intervals_hold_the_truth(white, walk, span_s):
    rng, inside = np.random.default_rng(6), []
    for _ in range(100):
        found = fitted(record(rng, span_s, white, walk)).coefficients
        inside.append([c.low <= true <= c.high for c, true in ((found["N"], white), (found["K"], walk))])
    assert np.all(np.mean(inside, axis=0) >= 0.87), np.mean(inside, axis=0)


def test_white_noise_has_n_alone():
    found = fitted(record(np.random.default_rng(7), 3600)).coefficients
    assert found["N"].value == pytest.approx(1.0, rel=0.03) and found["N"].unit == "ppm*sqrt(s)"
    assert [found[name].value for name in "BKR"] == [None] * 3
    assert 0.0 < found["K"].high < 0.02


def test_a_ramp_is_a_drift():
    found = fitted(record(np.random.default_rng(8), 3600, ramp=0.01)).coefficients
    assert found["R"].value == pytest.approx(0.01, rel=0.1) and found["R"].low < 0.01 < found["R"].high


def test_a_floor_is_reported_where_there_is_one_and_nowhere_else():
    """White noise over flicker, with a walk at the end, has a floor; neither half alone, nor white noise with a walk."""
    rng = np.random.default_rng(9)
    n = 2**17
    white, walk, pink = 40.0 * rng.standard_normal(n), np.cumsum(rng.standard_normal(n)), flicker(rng, n)
    whole, floor = fitted(white + 3.0 * pink + 0.1 * walk), np.median(allan_curve(regular(DT_S * np.arange(n), pink)).deviation[:-4])
    assert whole.coefficients["B"].value == pytest.approx(3.0 * floor / 0.664, rel=0.1)
    assert whole.coefficients["B"].low < 3.0 * floor / 0.664 < whole.coefficients["B"].high
    for other in (white, walk, white + 0.05 * walk, white[:2000] + 3.0 * pink[:2000]):
        assert fitted(other).coefficients["B"].value is None


def test_a_valley_between_noise_and_walk_is_rarely_called_a_floor():
    rng = np.random.default_rng(10)
    assert sum(fitted(record(rng, 7200, 1.0, 0.02)).coefficients["B"].value is not None for _ in range(100)) <= 3


@given(st.floats(1e-3, 1e3))
def test_units_scale_all_coefficients(scale):
    value = record(np.random.default_rng(11), 3600, 1.0, 0.1)
    here, there = fitted(value).coefficients, fitted(scale * value).coefficients
    for name in "NKR":
        assert there[name].low == pytest.approx(scale * here[name].low, rel=1e-6)
        assert there[name].high == pytest.approx(scale * here[name].high, rel=1e-6)


def test_a_forecast_is_the_scatter_of_longer_records():
    """N = 1, K = 0.02 at 2 Hz: K is known to some 20 % after an hour and better after ten, as the scatter of 60 such records says."""
    rng = np.random.default_rng(12)
    short = fitted(record(rng, 3600, 1.0, 0.02))
    forecasts = [forecast_relative_u(short, "K", span_s) for span_s in (900, 3600, 36000)]
    assert forecasts[0] > 0.4 and 0.15 < forecasts[1] < 0.35 and forecasts[2] < 0.1
    scatter = np.std([np.sqrt(fitted(record(rng, 3600, 1.0, 0.02)).squares[2]) for _ in range(60)]) / 0.02
    assert 0.7 < forecasts[1] / scatter < 1.6


def test_without_any_walk_the_forecast_is_that_of_the_upper_limit():
    found = fitted(record(np.random.default_rng(13), 90))
    assert found.coefficients["K"].value is None and forecast_relative_u(found, "K", 3600) < forecast_relative_u(found, "K", 90)


def test_another_shape_widens_the_intervals():
    """A swing is neither noise nor walk nor drift."""
    t_s = DT_S * np.arange(20_000)
    plain, swing = (fitted(record(np.random.default_rng(14), 10_000) + size * np.sin(t_s / 100.0)) for size in (0.0, 20.0))
    assert birge_ratio(plain.curve, plain.squares) < 1.5 and birge_ratio(swing.curve, swing.squares) > 2.0
    widths = [f.coefficients["N"].high - f.coefficients["N"].low for f in (plain, swing)]
    assert widths[1] > 1.3 * widths[0]


def test_readings_that_never_change_have_no_noise():
    with pytest.raises(NotObservable, match="do not change"):
        fitted(np.full(100, 7.0))
