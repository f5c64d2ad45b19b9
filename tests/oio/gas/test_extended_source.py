"""Lines and rings: their field is the integral of a point's over them, and their derivatives are its own."""

import numpy as np
import pytest
from scipy.integrate import quad

from oio.gas.extended_source import extended_source
from oio.gas.range_law import LAW, concentration_at
from oio.gas.source_shape import LINE, RING

THETA = np.array([0.3, 0.05, 0.2, np.log(30.0), 1.1, 4.0, -2.0, 1.0, 0.8])
SCALE = (0.1, 0.01)
HALF = {LINE: np.array([0.03, -0.02, 0.04]), RING: np.array([0.01, 0.02, 0.045])}
PLACES = ([0.42, 0.05, 0.2], [0.3, 0.2, 0.25], [0.2, -0.05, 0.3])


def field(p, theta, half, kind):
    grad, by_half = np.empty(LAW), np.empty(LAW)
    c, r, rarity = extended_source(tuple(np.asarray(p) - theta[:3]), theta, tuple(half), kind == RING, SCALE, grad, by_half)
    return c, r, rarity, grad, by_half[:3]


def of_point(p, theta, offset):
    d = np.asarray(p) - theta[:3] - offset
    return concentration_at(*d, theta, *SCALE, np.empty(LAW))[0]


@pytest.mark.parametrize("place", PLACES)
def test_a_line_is_its_points_together(place):
    expected = 0.5 * quad(lambda u: of_point(place, THETA, u * HALF[LINE]), -1.0, 1.0)[0]
    assert field(place, THETA, HALF[LINE], LINE)[0] == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("place", PLACES)
def test_a_ring_is_its_points_together(place):
    half = HALF[RING]
    radius = np.linalg.norm(half)
    one = np.cross(half, [1.0, 0.0, 0.0])
    one /= np.linalg.norm(one)
    two = np.cross(half / radius, one)
    expected = quad(lambda a: of_point(place, THETA, radius * (np.cos(a) * one + np.sin(a) * two)), 0.0, 2.0 * np.pi)[0] / (2.0 * np.pi)
    assert field(place, THETA, half, RING)[0] == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("kind", [LINE, RING])
def test_without_extent_it_is_a_point(kind):
    c, _, _, grad, _ = field(PLACES[0], THETA, np.zeros(3), kind)
    own = np.empty(LAW)
    assert c == pytest.approx(concentration_at(*(np.array(PLACES[0]) - THETA[:3]), THETA, *SCALE, own)[0], rel=1e-4)
    np.testing.assert_allclose(grad, own, rtol=1e-3, atol=1e-3)


@pytest.mark.parametrize("kind", [LINE, RING])
@pytest.mark.parametrize("place", PLACES)
def test_derivatives_are_central_differences(kind, place):
    _, _, _, grad, by_half = field(place, THETA, HALF[kind], kind)
    for j in range(LAW):
        step = 1e-6 * np.eye(LAW)[j]
        more, less = (field(place, THETA + sign * step, HALF[kind], kind)[0] for sign in (1.0, -1.0))
        assert grad[j] == pytest.approx((np.log(more) - np.log(less)) / 2e-6, abs=1e-5)
    for a in range(3):
        step = 1e-6 * np.eye(3)[a]
        more, less = (field(place, THETA, HALF[kind] + sign * step, kind)[0] for sign in (1.0, -1.0))
        assert by_half[a] == pytest.approx((np.log(more) - np.log(less)) / 2e-6, abs=1e-5 if kind == LINE else 0.05)  # eight points turn
