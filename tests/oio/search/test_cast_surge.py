"""Surging and casting: upwind on a hit, across and ever wider while nothing is smelt."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.core.errors import BadInput
from oio.gas.range_law import LAW
from oio.search.cast_surge import CastSurge, cast_direction
from oio.search.step_planning import box_diagonal_m, tangent_directions
from oio.search.view import Move, View

CAST = CastSurge(surge=0.06, cast_growth=0.03, max_cast=0.3, hit=0.15, threshold_decay=0.8, windy_per_m=3.0)
WIND = np.array([6.0, 3.0, 0.0])


@pytest.fixture(scope="module")
def room(built, lab):
    """A nose on three rails in the middle of a room: nothing is in its way."""
    arm = built("arm", "arm=gantry", "dof=3")
    return View(arm, replace(lab(3).model, arm=arm), None, (), (), dwell_s=60.0, standoff_m=0.0)


def windy(view, k=WIND):
    law = np.zeros(LAW)
    law[4], law[5:8] = 1.0, k
    return replace(view, law=law)


def after(view, moves, smelt=(0.0, 0.0)):
    """The view after so many more moves, all of which smelt the same (bouts, ppm), and the noses (moves, 3) m."""
    noses = []
    for seed in range(moves):
        q = CAST.propose(view, np.random.default_rng(seed))
        noses.append(view.arm.nose(q))
        view = replace(view, moves=(*view.moves, Move(q, *smelt)))
    return view, np.array(noses)


@pytest.mark.parametrize("k", [np.zeros(3), WIND])
def test_casts_widen_while_nothing_is_smelt(room, k):
    _, noses = after(windy(room, k), 5)  # the ceiling is near
    wide = np.linalg.norm(noses - room.arm.nose(room.arm.home), axis=1)
    np.testing.assert_allclose(wide, CAST.cast_growth * box_diagonal_m(room) * np.arange(1, 6), atol=0.02)


@pytest.mark.parametrize("dof", [2, 3, 5])
def test_they_widen_on_the_arm_too_until_its_box_ends(lab, dof):
    made = lab(dof)
    view = View(made.arm, made.model, None, (), (), dwell_s=1.0, standoff_m=0.0)
    _, noses = after(view, 4)
    wide = np.linalg.norm(noses - made.arm.nose(made.arm.home), axis=1)
    assert np.all(np.diff(wide) > 0)


def test_casts_are_across_the_wind(room):
    _, noses = after(windy(room), 5)
    np.testing.assert_allclose((noses - room.arm.nose(room.arm.home)) @ WIND, 0.0, atol=0.1)


def test_when_the_casts_are_widest_the_plume_is_looked_for_anywhere(room):
    _, noses = after(windy(room), 16)
    assert np.max(np.abs((noses[10:] - room.arm.nose(room.arm.home)) @ WIND)) > 3.0


def test_hits_surge_upwind(room):
    _, noses = after(windy(room), 3, (0.5, 10.0))  # the first is a cast: nothing was smelt before it
    steps = np.diff(noses, axis=0)
    np.testing.assert_allclose(steps, np.tile(-CAST.surge * box_diagonal_m(room) * WIND / np.linalg.norm(WIND), (2, 1)), atol=0.02)


def test_a_miss_casts_about_the_last_hit(room):
    view, noses = after(windy(room), 2, (0.5, 10.0))
    view = replace(view, moves=(*view.moves, Move(room.arm.home, 0.0, 0.0)))
    _, casts = after(view, 3)
    apart = np.linalg.norm(casts - noses[-1], axis=1)
    np.testing.assert_allclose(apart, CAST.cast_growth * box_diagonal_m(room) * np.arange(1, 4), atol=0.02)


def test_in_still_air_it_goes_on_from_hit_to_hit(room):
    first, second = room.arm.home + np.array([0.1, 0.0, 0.0]), room.arm.home + np.array([0.1, 0.2, 0.0])
    view = replace(room, moves=(Move(first, 0.5, 1.0), Move(second, 0.5, 2.0)))
    goal = room.arm.nose(CAST.propose(view, np.random.default_rng(0)))
    np.testing.assert_allclose(goal - second, [0.0, CAST.surge * box_diagonal_m(room), 0.0], atol=0.02)


@given(st.lists(st.tuples(st.floats(0, 1), st.floats(0, 100)), max_size=30))
def test_hits_have_bouts_and_rise_from_one_to_the_next_unless_there_were_misses(moves):
    made = tuple(Move(np.zeros(1), *move) for move in moves)
    hits = CAST.hits(made)
    assert all(made[i].bouts >= CAST.hit for i in hits)
    for a, b in pairwise(hits):
        assert made[b].ppm >= 0.999999 * made[a].ppm * CAST.threshold_decay ** (b - a - 1)


def test_every_miss_asks_for_less():
    smelt = [Move(np.zeros(1), 1.0, ppm) for ppm in (10.0, 9.0, 9.0)]
    assert CAST.hits(tuple(smelt)) == [0, 2]


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(0, 50), r=st.integers(1, 3))
def test_a_cast_is_a_unit_vector_that_the_nose_can_go_and_that_is_across_if_there_is_one(seed, n, r):
    rng = np.random.default_rng(seed)
    can = np.linalg.qr(rng.standard_normal((3, 3)))[0][:, :r]
    direction = can @ rng.standard_normal(r)
    direction /= np.linalg.norm(direction)
    cast = cast_direction(direction, can, n)
    assert np.linalg.norm(cast) == pytest.approx(1.0)
    np.testing.assert_allclose(can @ (can.T @ cast), cast, atol=1e-9)
    assert r == 1 or abs(cast @ direction) < 1e-9


def test_casts_go_left_and_right_on_a_surface_and_round_in_space(lab):
    for dof, opposite in ((2, -1.0), (3, np.cos(np.pi * (3.0 - np.sqrt(5.0))))):
        arm = lab(dof).arm
        can = tangent_directions(View(arm, lab(dof).model, None, (), (), 1.0, 0.0), arm.home)
        casts = np.array([cast_direction(can[:, 0], can, n) for n in range(1, 6)])
        np.testing.assert_allclose(np.sum(casts[1:] * casts[:-1], axis=1), opposite, atol=1e-9)


@pytest.mark.parametrize(
    ("key", "value"), [("surge", 0.0), ("max_cast", 0.01), ("hit", 2.0), ("threshold_decay", -0.1), ("windy_per_m", -1.0)]
)
def test_senseless_settings_are_refused(key, value):
    with pytest.raises(BadInput, match=key):
        replace(CAST, **{key: value})
