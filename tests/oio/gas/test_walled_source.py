"""A source before walls is what the simulator's image method makes of it, and its derivatives are central differences."""

import numpy as np
import pytest

from hardware.air.bodies import Plane, with_bodies
from oio.gas.range_law import LAW, concentration_at
from oio.gas.walled_source import BEHIND, EDGE_M, walled_source

THETA = np.array([0.3, 0.05, 0.2, np.log(30.0), 1.1, 4.0, -2.0, 1.0, 0.8])
SCALE = (0.1, 0.01)
U, V = np.array([0.04, 0.03, 0.0]), np.array([0.03, -0.04, 0.05])
PLACES = ([0.22, 0.05, 0.2], [0.25, -0.1, 0.1], [0.2, -0.05, 0.1], [0.3, 0.05, 0.1])


def field(p, theta, feet, corner):
    grad, by_feet = np.empty(LAW), np.zeros(6)
    d = tuple(np.asarray(p) - theta[:3])
    c, r, rarity = walled_source(d, theta, tuple(feet), corner, SCALE, grad, by_feet)
    return c, r, rarity, grad, by_feet


def plain(p_m):
    return concentration_at(*(p_m - THETA[:3]), THETA, *SCALE, np.empty(LAW))[0]


def plane(foot):
    return Plane(THETA[:3] + foot, -foot / np.linalg.norm(foot))


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("corner", [False, True])
def test_it_is_the_image_method(place, corner):
    """In wind too: the wall turns it about."""
    expected = with_bodies(plain, [plane(U), plane(V)] if corner else [plane(U)])(np.array(place))
    c, r, rarity, _, _ = field(place, THETA, [*U, *V], corner)
    assert c == pytest.approx(expected, rel=1e-3)  # the walls' edge is soft
    assert np.linalg.norm(np.array(place) - THETA[:3]) < r < 0.4 and rarity >= 1.0  # means over the images, all farther than the source


def test_what_the_second_wall_has_along_the_first_does_not_count():
    c, _, _, _, by_feet = field(PLACES[0], THETA, [*U, *(V + 3.0 * U)], corner=True)
    assert c == pytest.approx(field(PLACES[0], THETA, [*U, *V], corner=True)[0], rel=1e-12)
    assert by_feet[3:] @ U == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("corner", [False, True])
def test_derivatives_are_central_differences(place, corner):
    feet = np.array([*U, *(V + 0.4 * U)])
    _, _, _, grad, by_feet = field(place, THETA, feet, corner)
    for j in range(LAW):
        step = 1e-6 * np.eye(LAW)[j]
        more, less = (field(place, THETA + sign * step, feet, corner)[0] for sign in (1.0, -1.0))
        assert grad[j] == pytest.approx((np.log(more) - np.log(less)) / 2e-6, abs=1e-5)
    for a in range(6 if corner else 3):
        step = 1e-6 * np.eye(6)[a]
        more, less = (field(place, THETA, feet + sign * step, corner)[0] for sign in (1.0, -1.0))
        assert by_feet[a] == pytest.approx((np.log(more) - np.log(less)) / 2e-6, abs=1e-5)


@pytest.mark.parametrize("foot", [U, V])
def test_behind_either_wall_there_is_next_to_nothing(foot):
    """And what little there is, is as rare as the axis of a plume is seldom there."""
    there = foot / np.linalg.norm(foot) * 10.0 * EDGE_M
    before, behind = (field(THETA[:3] + foot + sign * there, THETA, [*U, *V], corner=True) for sign in (-1.0, 1.0))
    assert behind[0] == pytest.approx(BEHIND * before[0], rel=0.06)  # the mirror image of a place has as much
    assert before[2] < 3.0 < 500.0 < behind[2]


def test_far_from_walls_it_is_a_point():
    c, _, _, grad, by_feet = field(PLACES[0], THETA, 1e4 * np.array([*U, *V]), corner=True)
    own = np.empty(LAW)
    assert c == pytest.approx(concentration_at(*(np.array(PLACES[0]) - THETA[:3]), THETA, *SCALE, own)[0], rel=1e-9)
    np.testing.assert_allclose(grad, own, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(by_feet, 0.0, atol=1e-6)
