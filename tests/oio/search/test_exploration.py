"""Scouting: it spreads out in still air, and in wind goes where a plume would be smelt, given where it was smelt and where it was not."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from oio.gas.range_law import LAW, concentration
from oio.search.exploration import GRID_POINTS, WINDY_PER_M, _source_grid, _source_posterior, explore
from oio.search.view import Move, View

pytestmark = pytest.mark.long

K_PER_M = 60.0
angles = st.floats(-np.pi, np.pi)


def law(wind_per_m, source=(0.0, 0.0, 0.0), strength_ppm=20.0):
    theta = np.zeros(LAW)
    theta[:3], theta[3], theta[4], theta[5:8] = source, np.log(strength_ppm), 1.0, wind_per_m
    return theta


def towards(angle, lift=0.0):
    """A wind (3,) 1/m."""
    v = np.array([np.cos(angle), np.sin(angle), lift])
    return K_PER_M * v / np.linalg.norm(v)


def begun(lab, dof=5, wind=None):
    made = lab(dof)
    return View(made.arm, made.model, None, (), (), dwell_s=1.0, standoff_m=0.04, law=None if wind is None else law(wind))


def walked(view, seed, smells):
    """The same view after moves anywhere that smelt something, or did not."""
    rng, moves = np.random.default_rng(seed), []
    for smell in smells:
        q = view.arm.random_pose(rng)
        moves.append(Move(q, float(smell), float(smell), q if smell else None, not smell))
    return replace(view, moves=(*view.moves, *moves))


def middle(view):
    """Somewhere in the midst of the box that the nose can be brought to: (n,) rad."""
    rng, centre = np.random.default_rng(0), 0.5 * (np.array(view.arm.box_low_m) + view.arm.box_high_m)
    poses = np.array([view.arm.random_pose(rng) for _ in range(300)])
    return poses[np.argmin(np.linalg.norm(view.arm.nose(poses) - centre, axis=1))]


def apart(noses):
    return min(np.linalg.norm(a - b) for i, a in enumerate(noses) for b in noses[:i])


@pytest.mark.parametrize("wind", [None, (0.0, 0.0, 0.0), (0.9 * WINDY_PER_M, 0.0, 0.0)])
def test_in_still_air_it_spreads_out(lab, wind):
    view, rng = begun(lab, 3, wind), np.random.default_rng(0)
    noses = [view.arm.nose(view.arm.home)]
    for _ in range(5):
        goal = explore(view, rng)
        noses.append(view.arm.nose(goal))
        view = replace(view, moves=(*view.moves, Move(goal, 0.0, 1.0)))
    assert apart(noses) > 0.05


@settings(max_examples=30)
@given(angle=angles, lift=st.floats(-0.5, 0.5), seed=st.integers(0, 10**6), smells=st.lists(st.booleans(), max_size=12))
def test_chances_are_chances(lab, angle, lift, seed, smells):
    wind = towards(angle, lift)
    chances = _source_posterior(walked(begun(lab, 3, wind), seed, smells), wind)
    assert chances.shape == (GRID_POINTS,) and np.all(chances > 0.0) and np.sum(chances) == pytest.approx(1.0, rel=1e-12)


def beside(view, q, wind):
    """Of the places: how far upwind of the nose at q [m], and how far off the line through it (j,)."""
    d = _source_grid(view) - view.arm.nose(q)
    upwind = -d @ wind / np.linalg.norm(wind)
    return upwind, np.linalg.norm(d + upwind[:, None] * wind / np.linalg.norm(wind), axis=1)


@settings(max_examples=30)
@given(angle=angles)
def test_places_upwind_of_where_nothing_was_smelt_lose_chance(lab, angle):
    """A nose in the midst that stands still: places upwind on its line lose, those as far downwind gain, for something has to be there."""
    wind = towards(angle)
    view = begun(lab, 5, wind)
    q = middle(view)
    there = replace(view, moves=(Move(q, 0.0, 0.0, None, True),) * 2)  # the second one stays: the way to the first is another matter
    before, after = (_source_posterior(replace(there, moves=there.moves[:n]), wind) for n in (1, 2))
    upwind, off = beside(view, q, wind)
    ratio = after / before
    assert np.all(ratio[upwind < -0.05] > 1.0)
    near = (upwind > 0.0) & (upwind < 0.25) & (off < 0.3 * upwind)
    assume(np.any(near))  # at some angles no place lies in so narrow a cone
    assert np.mean(ratio[near]) < np.mean(ratio[~near])
    assert np.argmin(ratio) in np.flatnonzero(upwind > 0.0)


@settings(max_examples=30)
@given(angle=angles)
def test_after_a_smell_the_chance_moves_upwind_of_it(lab, angle):
    """Upwind and toward the line through it; the more the more often, for one smell may have been of something else."""
    wind = towards(angle)
    view = begun(lab, 5, wind)
    q = middle(view)
    upwind, off = beside(view, q, wind)
    once, thrice = (_source_posterior(replace(view, moves=(Move(q, 1.0, 9.0, q, False),) * n), wind) for n in (1, 3))
    assert thrice @ upwind > once @ upwind > np.mean(upwind)
    assert thrice @ off < once @ off < np.mean(off)
    assert thrice @ (upwind > -0.02) > 0.9


def test_it_is_the_place_of_the_smell_that_counts_not_the_end_of_the_move(lab):
    wind = towards(0.0)
    view = begun(lab, 5, wind)
    here, elsewhere = middle(view), view.arm.random_pose(np.random.default_rng(5))
    passed = _source_posterior(replace(view, moves=(Move(elsewhere, 1.0, 9.0, here, False),)), wind)
    stayed = _source_posterior(replace(view, moves=(Move(here, 1.0, 9.0, here, False),)), wind)
    np.testing.assert_array_equal(passed, stayed)


@settings(max_examples=12)
@given(angle=angles, lift=st.floats(-0.5, 0.5), seed=st.integers(0, 10**6), smells=st.lists(st.booleans(), max_size=6))
@pytest.mark.parametrize("dof", [1, 2, 3, 5])
def test_what_it_proposes_can_be_reached_inside_the_box(lab, dof, angle, lift, seed, smells):
    view = walked(begun(lab, dof, towards(angle, lift)), seed, smells)
    goal = explore(view, np.random.default_rng(seed))
    assert view.arm.is_allowed(goal)
    assert view.arm.path_is_free(view.moves[-1].q if view.moves else view.arm.home, goal)
    assert goal.tobytes() == explore(view, np.random.default_rng(seed)).tobytes()


def test_a_room_is_scouted_as_well(built, lab):
    arm = built("arm", "arm=gantry", "dof=3")
    view = View(arm, replace(lab(3).model, arm=arm), None, (), (), dwell_s=1.0, standoff_m=0.2, law=law(towards(0.3)))
    for seed in range(4):
        goal = explore(view, np.random.default_rng(seed))
        assert view.arm.is_allowed(goal)
        view = replace(view, moves=(*view.moves, Move(goal, 0.0, 0.0, None, True)))


HEARD_PPM, MOST = 2.0, 40


def moves_until_smelt(view, source, wind, seed):
    """In how many moves an own-model plume is smelt, on the way or at its end; MOST if not before."""
    rng, here, theta = np.random.default_rng(seed), view.arm.home, law(wind, source)
    for n in range(1, MOST):
        goal = explore(view, rng)
        way = view.arm.nose(here + np.linspace(0.0, 1.0, 20)[:, None] * (goal - here))
        if np.max(concentration(way, theta, 0.1, 0.01)[0]) > HEARD_PPM:
            return n
        here, view = goal, replace(view, moves=(*view.moves, Move(goal, 0.0, 0.0, None, True)))
    return MOST


def test_a_plume_is_smelt_in_fewer_moves_than_by_spreading_out(lab):
    """Twenty sources and winds; who is not told of the wind spreads out."""
    rng, told, untold = np.random.default_rng(4), [], []
    for seed in range(20):
        source, wind = rng.uniform([0.20, -0.25, 0.08], [0.42, 0.25, 0.28]), towards(rng.uniform(-np.pi, np.pi))
        told.append(moves_until_smelt(begun(lab, 5, wind), source, wind, seed))
        untold.append(moves_until_smelt(begun(lab, 5), source, wind, seed))
    assert np.median(told) < np.median(untold)
