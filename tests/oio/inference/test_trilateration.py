"""Spheres to circle to two points to vertex, and what geometry cannot tell."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from oio.core.errors import NotObservable
from oio.inference.belief_map import search_problem
from oio.inference.trilateration import (
    circle_sphere_intersection,
    dilution_of_precision,
    linear_source,
    sphere_intersection,
    vertex,
    vertex_unknown_strength,
)

points = st.tuples(*[st.floats(-0.4, 0.4)] * 3).map(np.array)


def spread(centres):
    return np.linalg.svd(np.array(centres[1:]) - centres[0], compute_uv=False)


@given(points, points, points)
def test_the_circle_lies_on_both_spheres(s, a, b):
    assume(np.linalg.norm(np.cross(s - a, s - b)) > 1e-4)
    ring = sphere_intersection(a, float(np.linalg.norm(s - a)), b, float(np.linalg.norm(s - b)))
    assert (s - ring.centre) @ ring.normal == pytest.approx(0.0, abs=1e-7)
    assert np.linalg.norm(s - ring.centre) == pytest.approx(ring.radius, abs=1e-4)


def test_spheres_that_touch_meet_in_a_point():
    a, b = np.full(3, 0.25), np.array([0.0, 0.25, 0.0])
    assert sphere_intersection(a, float(np.linalg.norm(b - a)), b, 0.0).radius == pytest.approx(0.0, abs=1e-6)


@given(points, points, st.floats(-1.0, 2.0), st.floats(1e-6, 1e6))
def test_spheres_that_touch_from_inside_or_outside_meet_in_a_point(a, b, share, scale):
    """The point at `share` of the way from a to b is on both: outside each other between 0 and 1, else one inside the other."""
    a, b = scale * a, scale * b
    d = float(np.linalg.norm(b - a))
    assume(d > 1e-3 * scale and d > 1e-9)
    ring = sphere_intersection(a, abs(share) * d, b, abs(1.0 - share) * d)
    assert ring.radius < 1e-6 * scale
    np.testing.assert_allclose(ring.centre, a + share * (b - a), atol=1e-6 * scale)


@pytest.mark.parametrize("r2", [0.5 - 1e-7, 1.5 + 1e-7])
def test_a_gap_that_is_no_rounding_is_refused_with_its_size(r2):
    with pytest.raises(NotObservable, match=r"miss each other by 0\.0001 mm"):
        sphere_intersection(np.zeros(3), 0.5, np.array([1.0, 0.0, 0.0]), r2)


def test_circle_by_hand():
    ring = sphere_intersection(np.zeros(3), 5.0, np.array([8.0, 0.0, 0.0]), 5.0)
    np.testing.assert_allclose(ring.centre, [4.0, 0.0, 0.0])
    np.testing.assert_allclose(ring.normal, [1.0, 0.0, 0.0])
    assert ring.radius == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("apart", "radius", "said"),
    [(0.0, 0.1, "the same centre"), (0.3, 0.1, "miss each other by 100 mm"), (0.05, 0.3, "miss each other by 150 mm")],
)
def test_spheres_that_do_not_meet_are_refused(apart, radius, said):
    with pytest.raises(NotObservable, match=said):
        sphere_intersection(np.zeros(3), 0.1, np.array([apart, 0.0, 0.0]), radius)


@given(points, points, points, points)
def test_two_points_are_mirror_images_in_the_plane_of_the_centres(s, a, b, c):
    normal = np.cross(b - a, c - a)
    assume(np.linalg.norm(normal) > 0.01 and abs((s - a) @ normal) > 1e-3)
    normal = normal / np.linalg.norm(normal)
    radii = [float(np.linalg.norm(s - p)) for p in (a, b, c)]
    one, other = circle_sphere_intersection(sphere_intersection(a, radii[0], b, radii[1]), c, radii[2])
    assert min(np.linalg.norm(one - s), np.linalg.norm(other - s)) < 1e-5
    np.testing.assert_allclose(one - 2 * ((one - a) @ normal) * normal, other, atol=1e-6)


def test_a_third_sphere_that_misses_or_is_in_line_is_refused():
    ring = sphere_intersection(np.zeros(3), 0.5, np.array([0.8, 0.0, 0.0]), 0.5)
    with pytest.raises(NotObservable, match="in line"):
        circle_sphere_intersection(ring, np.array([2.0, 0.0, 0.0]), 1.0)
    with pytest.raises(NotObservable, match="misses the circle"):
        circle_sphere_intersection(ring, np.array([0.4, 3.0, 0.0]), 0.1)


@given(points, st.lists(points, min_size=4, max_size=8))
def test_the_vertex_of_exact_ranges_is_the_source(s, centres):
    radii = np.linalg.norm(np.array(centres) - s, axis=1)
    assume(spread(centres)[2] > 0.02 and np.min(radii) > 1e-3)
    np.testing.assert_allclose(vertex(np.array(centres), radii), s, atol=1e-6)


@given(points, st.lists(points, min_size=5, max_size=8), st.floats(-3, 3), points, st.integers(0, 1000))
def test_turning_shifting_and_shuffling_move_the_vertex_along(s, centres, angle, shift, seed):
    assume(spread(centres)[2] > 0.05)
    rng = np.random.default_rng(seed)
    p = np.array(centres)
    r = np.linalg.norm(p - s, axis=1) * np.exp(0.02 * rng.standard_normal(len(p))) + 1e-3
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    order = rng.permutation(len(p))
    np.testing.assert_allclose(vertex((p @ turn.T + shift)[order], r[order]), turn @ vertex(p, r) + shift, atol=1e-6)


LINE = np.outer(np.arange(5.0), [0.1, 0.05, 0.0])
PLANE = np.array([[0.0, 0.0, 0.1], [0.1, 0.0, 0.1], [0.0, 0.1, 0.1], [0.1, 0.1, 0.1], [0.05, 0.2, 0.1]])


@pytest.mark.parametrize(
    ("centres", "said"),
    [(LINE, "on a line; move another joint"), (PLANE, "in a plane, which leaves two mirror points"), (PLANE[:3], "sniff at 1 more places")],
)
def test_what_leaves_more_than_one_point_is_refused_in_words(centres, said):
    with pytest.raises(NotObservable, match=said):
        vertex(centres, np.linalg.norm(centres - [0.2, 0.1, 0.3], axis=1))


def test_dilution_is_the_spread_of_a_least_squares_fit():
    rng, source = np.random.default_rng(0), np.array([0.3, 0.05, 0.2])
    centres = source + rng.uniform(-0.2, 0.2, (9, 3))
    d = centres - source
    rows = np.column_stack([d / np.sum(d**2, axis=1, keepdims=True), np.ones(9)])
    fits = np.linalg.lstsq(rows, 0.01 * rng.standard_normal((9, 5000)), rcond=None)[0][:3]
    assert np.sqrt(np.sum(np.var(fits, axis=1))) == pytest.approx(0.01 * dilution_of_precision(centres, source), rel=0.05)


def test_dilution_is_infinite_on_an_arc_and_finite_off_it():
    angle = np.linspace(-1, 1, 12)
    arc = np.column_stack([0.3 * np.cos(angle), 0.3 * np.sin(angle), np.full(12, 0.1)])
    source = np.array([0.4, 0.1, 0.2])
    assert dilution_of_precision(arc, source) == np.inf
    lifted = np.concatenate([arc, arc[::3] * 0.8 + [0.0, 0.0, 0.1]])
    assert 0 < dilution_of_precision(lifted, source) < 10


def test_more_sniffs_never_dilute():
    rng, source = np.random.default_rng(1), np.array([0.3, 0.05, 0.2])
    centres = source + rng.uniform(-0.2, 0.2, (20, 3))
    values = [dilution_of_precision(centres[:k], source) for k in range(5, 21)]
    assert np.all(np.diff(values) <= 1e-12)


@given(st.integers(0, 1000), st.integers(6, 12), st.floats(1e-3, 1e3))
def test_ratios_of_ranges_are_enough(seed, count, strength):
    """Exact ratios give the place whatever the strength is."""
    rng = np.random.default_rng(seed)
    centres, source = rng.uniform(-0.3, 0.3, (count, 3)), rng.uniform(-0.3, 0.3, 3)
    r = np.linalg.norm(centres - source, axis=1)
    assume(np.min(r) > 0.03)
    np.testing.assert_allclose(vertex_unknown_strength(centres, strength * r), source, atol=1e-5)


def test_ratios_do_not_tell_in_a_plane():
    rng = np.random.default_rng(0)
    flat = np.column_stack([rng.uniform(-0.3, 0.3, (8, 2)), np.zeros(8)])
    with pytest.raises(NotObservable, match="open"):
        vertex_unknown_strength(flat, np.linalg.norm(flat - [0.1, 0.0, 0.1], axis=1))
    with pytest.raises(NotObservable, match="2 more places"):
        vertex_unknown_strength(flat[:3], np.ones(3))


@given(exponent=st.floats(0.0, 0.3), ln_gain=st.floats(-8.0, 8.0))
def test_a_law_so_flat_that_ranges_overflow_is_no_crash(lab, exponent, ln_gain):
    """Exponents near zero come out of a beacon in a strong wind; ranges are then c^(-1/n)."""
    made = lab(3, 1, seed=525)
    problem = search_problem(made.problem(made.theta(), poses=12).sniffs, made.known)
    theta = problem.mean.copy()
    theta[problem.layout.exponent] = exponent
    theta[problem.layout.gain] = ln_gain
    start = linear_source(replace(problem, mean=theta), problem.nose(problem.mean))
    assert start.shape in ((0, 3), (1, 3)) and np.all(np.isfinite(start))


def test_elements_that_are_read_at_once_have_one_sphere(lab):
    made = lab(3, 1, seed=525)
    problem = search_problem(made.problem(made.theta(), poses=12).sniffs, made.known)
    one = linear_source(problem, problem.nose(problem.mean))
    sn = problem.sniffs
    twice = {name: np.repeat(getattr(sn, name), 2) for name in ("at", "reading_t_s", "element", "ppm", "sigma_ppm", "censored")}
    np.testing.assert_allclose(linear_source(replace(problem, sniffs=replace(sn, **twice)), problem.nose(problem.mean)), one, atol=1e-9)
    assert len(one) == 1


def test_differenced_spheres_come_near_the_source(lab):
    """A start, no answer: the median is within 5 cm."""
    misses = []
    for seed in range(12):
        made = lab(3, 1, seed=520 + seed)
        theta = made.theta()
        problem = search_problem(made.problem(theta, poses=12).sniffs, made.known)
        misses += [float(np.linalg.norm(place - theta[:3])) for place in linear_source(problem, problem.nose(problem.mean))]
    assert len(misses) > 9 and np.median(misses) < 0.05
