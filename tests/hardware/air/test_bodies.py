"""Walls reflect and block as the image method says, boxes and links as their approximation does."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from hardware.air.bodies import Box, Plane, segment_distance_m, shadow, with_bodies

SOURCE = np.array([0.3, 0.0, 0.2])
UP, X = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
PLACES = st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)).map(np.array)


def point(p_m):
    """1 / r."""
    return 1.0 / max(float(np.linalg.norm(p_m - SOURCE)), 1e-6)


def test_at_a_wall_the_field_is_doubled_and_behind_there_is_nothing():
    wall = Plane(SOURCE + 0.05 * X, -X)
    field = with_bodies(point, [wall])
    on_it = SOURCE + np.array([0.05, 0.08, 0.0])
    assert field(on_it) == pytest.approx(2.0 * point(on_it))
    assert field(SOURCE + 0.06 * X) == 0.0


@given(PLACES)
def test_no_gas_passes_a_wall(p):
    """The normal derivative is zero there: what a reflecting boundary means."""
    wall = Plane(SOURCE + 0.05 * X, -X)
    on_it = SOURCE + np.array([0.05, p[1] + 0.01, p[2]])
    field = with_bodies(point, [wall])
    slope = (field(on_it - 1e-5 * X) - field(on_it - 2e-5 * X)) / 1e-5
    assert abs(slope) < 1e-2 * field(on_it) / 0.05


def test_a_corner_has_three_images():
    walls = [Plane(SOURCE + 0.05 * X, -X), Plane(SOURCE - 0.05 * UP, UP)]
    p = SOURCE + np.array([0.01, 0.03, 0.02])
    images = [SOURCE, SOURCE + 0.1 * X, SOURCE - 0.1 * UP, SOURCE + 0.1 * X - 0.1 * UP]
    expected = sum(1.0 / np.linalg.norm(p - image) for image in images)
    assert with_bodies(point, walls)(p) == pytest.approx(expected) == pytest.approx(with_bodies(point, walls[::-1])(p))


def test_a_wall_that_reflects_nothing_only_blocks():
    field = with_bodies(point, [Plane(SOURCE + 0.05 * X, -X, reflects=0.0)])
    assert field(SOURCE - 0.1 * X) == point(SOURCE - 0.1 * X) and field(SOURCE + 0.1 * X) == 0.0


def test_a_box_hides_what_is_behind_it_and_reflects_in_front():
    box = Box(SOURCE + np.array([0.05, -0.05, -0.05]), SOURCE + np.array([0.1, 0.05, 0.05]), SOURCE, transmits=0.2)
    field = with_bodies(point, [box])
    behind, beside, before, within = (SOURCE + np.array(d) for d in ([0.15, 0, 0], [0.0, 0.2, 0.0], [-0.05, 0.0, 0.0], [0.07, 0, 0]))
    assert field(behind) == pytest.approx(0.2 * point(behind))
    assert field(beside) == point(beside)
    assert field(before) == pytest.approx(point(before) + 1.0 / 0.15)  # the image is 10 cm behind the source
    assert field(within) == 0.0
    assert box.hides(behind) and not box.hides(beside) and not box.hides(before)


@example(np.array([-1.2e-7, -1.2e-7, 0.0]), np.array([0.0, -1.2e-7, 0.0]), np.zeros(3), np.array([-0.5, 0.0, 0.25]))  # one next to none
@given(PLACES, PLACES, PLACES, PLACES)
def test_segments_are_as_far_apart_as_their_nearest_points(a, b, c, d):
    shares = np.linspace(0.0, 1.0, 41)
    on_ab, on_cd = (p + shares[:, None] * (q - p) for p, q in ((a, b), (c, d)))
    nearest = float(np.min(np.linalg.norm(on_ab[:, None] - on_cd[None], axis=2)))
    step = max(np.linalg.norm(b - a), np.linalg.norm(d - c)) / 40
    assert nearest - step - 1e-12 <= segment_distance_m(a, b, c, d) <= nearest + 1e-9


def test_a_link_between_source_and_nose_casts_a_shadow_and_the_last_one_on_what_is_behind_the_nose():
    nose = SOURCE - 0.2 * X
    joints = np.array([[0.2, -0.3, 0.2], [0.2, 0.3, 0.2], [0.0, 0.3, 0.2], nose])
    assert shadow(SOURCE, nose, joints, 0.02, 0.3) == 0.3
    assert shadow(SOURCE, nose, joints[1:], 0.02, 0.3) == 1.0
    assert shadow(SOURCE, nose, joints + np.array([0.0, 0.0, 0.05]), 0.02, 0.3) == 1.0
    assert shadow(nose + 0.2 * np.array([0.0, 1.0, 0.3]), nose, joints[1:], 0.02, 0.3) == 0.3  # the source is behind the wrist
