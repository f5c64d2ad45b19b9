"""Every kind of shape gives the field and the derivatives that the filter and the fit take, through one door."""

import numpy as np
import pytest

from oio.gas.range_law import LAW, concentration_at
from oio.gas.source_shape import CORNER, LINE, MOST, PARAMETERS, POINT_SOURCE, RING, TWO, WALL, SourceShape, against_nose, field_of_shape

THETA = np.array([0.3, 0.05, 0.2, np.log(30.0), 1.1, 4.0, -2.0, 1.0, 0.8])
SCALE = (0.1, 0.01)
PLACE = np.array([0.22, 0.12, 0.15])
VALUES = {
    TWO: [0.25, -0.1, 0.3, -0.5],
    LINE: [0.03, -0.02, 0.04],
    RING: [0.01, 0.02, 0.045],
    WALL: [0.04, -0.03, 0.0],
    CORNER: [0.04, -0.03, 0.0, 0.03, 0.04, 0.05],
}


def field(place, theta, kind, values):
    grad, by_shape = np.empty(LAW), np.zeros(MOST)
    first = concentration_at(*(place - theta[:3]), theta, *SCALE, grad)
    c, r, _ = field_of_shape(tuple(place), theta, SourceShape.of(kind, np.array(values)), SCALE, first, grad, by_shape)
    return c, grad, by_shape, r


def slope(of, values, j):
    step = 1e-6 * np.eye(len(values))[j]
    return (np.log(of(values + step)) - np.log(of(values - step))) / 2e-6


@pytest.mark.parametrize("kind", VALUES)
def test_derivatives_by_the_law_the_shape_and_the_nose(kind):
    values = np.array(VALUES[kind])
    assert len(values) == PARAMETERS[kind]
    _, grad, by_shape, _ = field(PLACE, THETA, kind, values)
    rough = 0.05 if kind == RING else 1e-5  # eight points turn
    for j in range(LAW):
        assert grad[j] == pytest.approx(slope(lambda theta: field(PLACE, theta, kind, values)[0], THETA, j), abs=1e-5)
    for j in range(len(values)):
        assert by_shape[j] == pytest.approx(slope(lambda v: field(PLACE, THETA, kind, v)[0], values, j), abs=rough)
    for axis in range(3):
        by_nose = slope(lambda place: field(place, THETA, kind, values)[0], PLACE, axis)
        assert against_nose(kind, grad, by_shape, axis) == pytest.approx(-by_nose, abs=1e-5)


@pytest.mark.parametrize("kind", VALUES)
def test_far_up_the_wind_where_nothing_is_left_there_is_no_division_by_it(kind):
    theta = np.array(THETA)
    theta[3], theta[5:8] = -700.0, [900.0, 0.0, 0.0]
    c, grad, by_shape, r = field(theta[:3] - np.array([1.0, 0.0, 0.0]), theta, kind, VALUES[kind])
    assert 0.0 < c < 1e-200 and r > 0.1 and np.all(np.isfinite(grad)) and np.all(np.isfinite(by_shape))


def test_two_sources_add_up():
    other = np.array(THETA)
    other[:3], other[3] = VALUES[TWO][:3], THETA[3] + VALUES[TWO][3]
    alone = sum(concentration_at(*(PLACE - theta[:3]), theta, *SCALE, np.empty(LAW))[0] for theta in (THETA, other))
    assert field(PLACE, THETA, TWO, VALUES[TWO])[0] == pytest.approx(alone, rel=1e-12)


def test_a_shape_has_room_for_the_parameters_of_every_kind():
    assert SourceShape.of(WALL, np.array([1.0, 2.0, 3.0])) == SourceShape(WALL, (1.0, 2.0, 3.0, 0.0, 0.0, 0.0))
    assert SourceShape() == POINT_SOURCE and max(PARAMETERS) == MOST
