"""The extended law: its Jacobian, what it reduces to, and that it finds what it is made for."""

from dataclasses import replace

import numpy as np
import pytest

from oio.gas.source_shape import CORNER, LINE, PARAMETERS, POINT, RING, TWO, WALL
from oio.inference.alternatives import extend
from oio.inference.law_extension import UNEXTENDED, LawExtension, random_walk_cov
from oio.inference.map_fit import solve

SHAPES = {
    POINT: [],
    TWO: [0.30, 0.15, 0.18, -0.4],
    LINE: [0.03, -0.02, 0.01],
    RING: [0.01, -0.02, 0.03],
    WALL: [0.45, 0.1, 0.0],  # no nose gets behind it,
    CORNER: [0.45, 0.1, 0.0, 0.1, 0.0, 0.6],  # nor behind these
}


def extended(problem, kind=TWO, knots=4, sd=0.2):
    """The problem with every extension at once, and a theta in it."""
    t = problem.sniffs.t_s
    at = tuple(np.linspace(t[0], t[-1], knots))
    extension = LawExtension(kind, at, at, at, joints=problem.arm.dof, begins_s=float(t[0]))
    return extend(problem, extension, [(range(extension.size), sd**2 * np.eye(extension.size))])


def silent_start(problem):
    ppm = np.array(problem.sniffs.ppm)
    ppm[0] = -100.0
    return replace(problem, sniffs=replace(problem.sniffs, ppm=ppm))


@pytest.mark.parametrize(
    ("dof", "elements", "kind"), [(3, 2, TWO), (5, 1, TWO), (3, 1, WALL), (3, 2, POINT), (3, 1, LINE), (5, 2, RING), (5, 1, CORNER)]
)
def test_rows_are_central_differences(lab, dof, elements, kind):
    made = lab(dof, elements, seed=70 + dof)
    theta = made.theta()
    problem = extended(silent_start(made.problem(theta)), kind)
    rng = np.random.default_rng(3)
    shape = np.array(SHAPES[kind])
    whole = np.concatenate([theta, shape, 0.3 * rng.standard_normal(problem.extension.size - len(shape))])
    drift = range(*(len(theta) + np.array([problem.extension.drift.start, problem.extension.drift.stop])))
    whole[drift] *= 1e-4
    rows, n = problem.predict(whole).rows, len(theta)
    for j in [*range(9), *range(9, 9 + dof), *range(n, problem.layout.size)]:
        step = np.zeros(problem.layout.size)
        step[j] = h = 1e-9 if j in drift else 1e-6
        numeric = (problem.predict(whole + step).ppm - problem.predict(whole - step).ppm) / (2 * h)
        rough = 1e-2 if kind == RING and n <= j < n + 3 else 1e-5  # that a ring's eight points turn about its normal is neglected
        np.testing.assert_allclose(rows[:, j], numeric, atol=rough * max(np.max(np.abs(numeric)), 1e-3), err_msg=str(j))


def test_an_extension_of_nothing_is_the_law_itself(lab):
    made = lab(3, 2, seed=75)
    theta = made.theta()
    problem = made.problem(theta)
    more = extended(problem)
    none = np.concatenate([theta, [5.0, 5.0, 5.0, -60.0], np.zeros(more.extension.size - 4)])  # far away, and next to no gas
    np.testing.assert_allclose(more.predict(none).ppm, problem.predict(theta).ppm, rtol=1e-9)
    assert UNEXTENDED.size == 0 and problem.layout.extra == 0


def test_a_second_source_adds_its_own_field(lab):
    """Gas adds up: the reading of both is the sum of the readings of each, in a sensor without memory of its beginning."""
    made = lab(3, 1, seed=76)
    theta = made.theta()
    problem = silent_start(made.problem(theta))
    problem = replace(problem, fall_s=problem.rise_s)  # else the lag depends on the slope
    both = extended(problem)
    zeros = np.zeros(both.extension.size - 4)
    alone, other = np.array(theta), np.array(theta)
    other[:3], other[3] = SHAPES[TWO][:3], theta[3] + SHAPES[TWO][3]
    expected = problem.expect(alone) + problem.expect(other)
    np.testing.assert_allclose(both.expect(np.concatenate([theta, SHAPES[TWO], zeros])), expected, rtol=1e-9)


@pytest.mark.parametrize("kind", [WALL, CORNER])
def test_behind_a_wall_there_is_next_to_nothing(lab, kind):
    made = lab(3, 1, seed=77)
    theta = made.theta()
    problem = silent_start(made.problem(theta))
    walled = extended(problem, kind)
    noses = problem.nose(theta)
    far = noses[np.argmax(np.linalg.norm(noses - theta[:3], axis=1))]
    foot = 0.6 * (far - theta[:3])  # the wall stands at 0.6 of the way to the farthest sniff
    feet = np.concatenate([foot, 9.0 * np.cross(foot, [0.0, 0.0, 1.0])])[: PARAMETERS[kind]]
    whole = np.concatenate([theta, feet, np.zeros(walled.extension.size - len(feet))])
    behind = (noses - theta[:3] - foot) @ foot > 0.0
    c = walled.predict(whole).along.field.mean_ppm
    assert np.any(behind) and np.max(c[behind]) < 0.01 * np.min(c[~behind])


def test_joints_that_drift_from_the_first_reading_on(lab):
    """The reading is as if the joints had been elsewhere, and the nose too."""
    made = lab(3, 1, seed=78)
    theta = made.theta()
    problem = silent_start(made.problem(theta))
    drift, t = np.array([2e-5, -1e-5, 3e-5]), problem.sniffs.t_s
    extension = LawExtension(joints=3, begins_s=float(t[0]))
    moved = extend(problem, extension, [(extension.drift, 1e-8 * np.eye(3))])
    elsewhere = replace(problem, sniffs=replace(problem.sniffs, q=problem.sniffs.q - 0.5 * (t[:, None] - t[0]) ** 2 * drift))
    whole = np.concatenate([theta, drift])
    np.testing.assert_allclose(moved.expect(whole), elsewhere.expect(theta), rtol=1e-9)
    np.testing.assert_allclose(moved.nose(whole), elsewhere.nose(theta), atol=1e-12)


def test_a_random_walk_spreads_with_the_root_of_time():
    knots = (2.0, 5.0, 9.0, 20.0)
    cov = random_walk_cov(knots, 0.3)
    np.testing.assert_allclose(np.sqrt(np.diag(cov)), 0.3 * np.sqrt([3.0, 7.0, 18.0]))
    np.testing.assert_allclose(cov[0], 0.09 * 3.0)  # increments are independent
    assert random_walk_cov((), 1.0).shape == (0, 0)


def test_the_blocks_follow_each_other():
    extension = LawExtension(TWO, (0.0, 1.0, 2.0), (0.0, 1.0), (0.0, 1.0, 2.0, 3.0))
    blocks = [*extension.shape, *extension.strength, *extension.wind, *extension.background]
    assert blocks == list(range(extension.size)) == list(range(4 + 2 + 3 + 3))


def test_what_was_drawn_is_found_again(lab):
    """Readings of a source that fades and a background that climbs: the fit has both, within three standard deviations."""
    made = lab(3, 1, seed=78)
    theta = made.theta()
    problem = made.problem(theta, poses=14)
    t = problem.sniffs.t_s
    knots = tuple(np.linspace(t[0], t[-1], 3))
    extension = LawExtension(strength_s=knots, background_s=knots)
    wide = extend(problem, extension, [(range(4), np.diag([1.0, 1.0, 4.0, 4.0]))])
    truth = np.concatenate([theta, [-0.4, -0.9, 0.5, 1.2]])
    shift = wide.predict(truth).ppm - problem.predict(theta).ppm
    wide = replace(wide, sniffs=replace(problem.sniffs, ppm=problem.sniffs.ppm + shift))
    fit = solve(wide, np.concatenate([theta, np.zeros(4)]), made.model.fluctuation)
    error, sd = (fit.mean - truth)[-4:], np.sqrt(np.diag(fit.cov))[-4:]
    assert np.all(np.abs(error) < 3.0 * sd) and np.all(sd < 0.7 * np.array([1.0, 1.0, 2.0, 2.0]))
