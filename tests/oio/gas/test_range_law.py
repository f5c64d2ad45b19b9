"""The law of mean concentration, its derivatives and symmetries; RSSI and back."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oio.core.errors import BadInput
from oio.gas.range_law import LAW, concentration
from oio.gas.rssi import Rssi

R_REF, RADIUS = 0.1, 0.01


def floats(low, high):
    return st.floats(low, high, allow_nan=False)


places = st.tuples(floats(-0.5, 0.5), floats(-0.5, 0.5), floats(0.0, 0.5)).map(np.array)
winds = st.one_of(  # from a gale to nothing, and nearly nothing
    st.tuples(floats(-20, 20), floats(-20, 20), floats(-5, 5)), st.tuples(*[floats(-1e-3, 1e-3)] * 3), st.just((0.0, 0.0, 0.0))
).map(np.array)
laws = st.builds(lambda s, l, n, k, u: np.concatenate([s, [l, n], k, [u]]), places, floats(-3, 8), floats(0.3, 3.0), winds, floats(-5, 5))


def ln_c(p, theta, r_ref=R_REF, radius=RADIUS):
    return np.log(concentration(np.atleast_2d(p), theta, r_ref, radius)[0])


def about_z(angle):
    return np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])


@settings(deadline=None)
@given(places, laws)
def test_gradient_is_the_central_difference(p, theta):
    grad, h = concentration(p[None, :], theta, R_REF, RADIUS)[1][0], 1e-6
    for j in range(LAW):
        step = np.eye(LAW)[j] * h
        numeric = (ln_c(p, theta + step)[0] - ln_c(p, theta - step)[0]) / (2 * h)
        assert grad[j] == pytest.approx(numeric, rel=1e-5, abs=1e-5)


@settings(deadline=None)
@given(places, laws)
def test_derivative_by_the_nose_is_minus_that_by_the_source(p, theta):
    grad, h = concentration(p[None, :], theta, R_REF, RADIUS)[1][0], 1e-6
    for j in range(3):
        step = np.eye(3)[j] * h
        numeric = (ln_c(p + step, theta)[0] - ln_c(p - step, theta)[0]) / (2 * h)
        assert -grad[j] == pytest.approx(numeric, rel=1e-5, abs=1e-5)


@settings(deadline=None)
@given(places, laws, floats(-3.1, 3.1), places)
def test_turning_and_shifting_the_world_changes_nothing(p, theta, angle, shift):
    turn, moved = about_z(angle), theta.copy()
    moved[:3], moved[5:8] = turn @ theta[:3] + shift, turn @ theta[5:8]
    here, there = concentration(p[None, :], theta, R_REF, RADIUS), concentration((turn @ p + shift)[None, :], moved, R_REF, RADIUS)
    for a, b in zip((here[0], here[2], here[3]), (there[0], there[2], there[3]), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-7)
    np.testing.assert_allclose(turn @ here[1][0, :3], there[1][0, :3], rtol=1e-6, atol=1e-7)


@settings(deadline=None)
@given(places, laws)
def test_in_still_air_metres_or_millimetres_are_the_same(p, theta):
    """In wind they are not: the scale below which |k| is smoothed is in 1/m."""
    theta[5:8] = 0.0
    scaled = theta.copy()
    scaled[:3], scaled[8] = 1e3 * theta[:3], 1e-3 * theta[8]
    np.testing.assert_allclose(ln_c(p, theta), ln_c(1e3 * p, scaled, 1e3 * R_REF, 1e3 * RADIUS), atol=1e-9)


def test_by_hand():
    """exp(2) at r_ref, half of it at twice r_ref; down wind by exp(-(|k| r - k d))."""
    still = np.array([0.0, 0.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    c, _, r, rarity = concentration(np.array([[0.1, 0.0, 0.0], [0.0, 0.2, 0.0]]), still, 0.1, 1e-9)
    np.testing.assert_allclose(c, [np.exp(2.0), np.exp(2.0) / 2])
    np.testing.assert_allclose(r, [0.1, 0.2])
    np.testing.assert_allclose(rarity, 1.0)
    windy = still.copy()
    windy[5] = 30.0
    down, up = ln_c(np.array([[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0]]), windy, 0.1, 1e-9)
    assert down - up == pytest.approx(2 * 30.0 * 0.1)
    assert down == pytest.approx(2.0, abs=0.06)  # |k| is smoothed by 0.5 / m


@settings(deadline=None)
@given(places, laws)
def test_rarity_is_between_one_and_a_thousand(p, theta):
    rarity = concentration(p[None, :], theta, R_REF, RADIUS)[3][0]
    assert 1.0 <= rarity <= 1000.0 * (1 + 1e-9)


@given(floats(0.01, 10.0), floats(-60, 60), floats(0.5, 3.0))
def test_rssi_to_range_and_back(d0, rssi0, n):
    rssi, r = Rssi(1.0, d0, rssi0, n), d0 * np.array([0.5, 1.0, 2.0, 4.0])
    c = 10.0 ** (rssi0 / 10) * (r / d0) ** -n
    seen = c > 1e-3
    np.testing.assert_allclose(rssi.range_m(rssi.of(c))[seen], r[seen], rtol=1e-9)
    np.testing.assert_allclose(rssi.of(c)[~seen], -30.0)


def test_no_gas_is_a_far_range_not_an_infinite_one():
    assert np.all(np.isfinite(Rssi(1.0, 0.1, 13.0, 1.0).of(np.array([0.0, -3.0]))))


def test_senseless_laws_are_refused(built):
    with pytest.raises(Exception, match="exponent is 9"):
        built("range_law", "range_law.exponent=9")
    with pytest.raises(Exception, match="r_ref_m is 0") as refused:
        built("range_law", "range_law.r_ref_m=0")
    assert isinstance(refused.value.__cause__, BadInput)


def test_a_strength_that_nobody_told_changes_nothing(built):
    law = built("range_law")
    assert law.ln_strength is None and law.with_unknown_strength() is law
    assert law.strength(23.0) == float(np.log(23.0))


def test_a_strength_that_was_told_is_that_of_its_source_alone(built):
    law = built("range_law", "range_law.ln_strength=3", "range_law.ln_strength_u=0.1")
    assert law.strength(23.0) == law.strength(0.1) == 3.0
    assert law.with_unknown_strength() == built("range_law")


@pytest.mark.parametrize("told", ["20.1", "-25", "1e9"])
def test_a_strength_that_is_no_logarithm_is_refused(built, told):
    with pytest.raises(Exception, match=r"-20 to 14 is allowed: it is the natural logarithm of ppm \(3 is 20 ppm\)") as refused:
        built("range_law", f"range_law.ln_strength={told}")
    assert isinstance(refused.value.__cause__, BadInput)


@pytest.mark.parametrize("told", ["strong", "nan", "true"])
def test_a_strength_that_is_no_number_is_refused(built, told):
    with pytest.raises(Exception, match="ln_strength is") as refused:
        built("range_law", f"range_law.ln_strength={told}")
    assert isinstance(refused.value.__cause__, BadInput)
