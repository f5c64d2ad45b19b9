"""Steps of a search: what the lag held back is made up for, places are reached as nearly as joints allow."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.search.sniff_history import sniff_history
from oio.search.step_planning import nearest_poses, step_toward, tangent_directions
from oio.search.view import Move, View


def view_of(made, *moves):
    return View(made.arm, made.model, None, (), moves, dwell_s=0.5, standoff_m=0.04)


@given(c=st.lists(st.floats(0.1, 100), min_size=1, max_size=10))
def test_a_lag_is_undone(lab, c):
    """From the second signal on: what was smelt before the first is not known."""
    made = lab(3)
    view, f, rng = view_of(made), c[0], np.random.default_rng(0)
    for ppm in c:
        before, q = view.moves[-1].q if view.moves else made.arm.home, made.arm.random_pose(rng)
        tau = made.model.rise_s if ppm > f else made.model.fall_s
        f = ppm + (f - ppm) * np.exp(-(view.dwell_s + 0.5 * made.arm.duration_s(before, q)) / tau)
        view = replace(view, moves=(*view.moves, Move(q, 0.0, f)))
    np.testing.assert_allclose(sniff_history(view).ppm, c, rtol=1e-6)


def test_moves_too_short_for_a_signal_are_left_out_and_nothing_is_made_of_them(lab):
    made = lab(3)
    q = made.arm.home
    seen = sniff_history(view_of(made, Move(q, 0.0, 0.0), Move(q, 0.0, 7.0), Move(q, 0.0, 0.0), Move(q, 0.0, 9.0)))
    np.testing.assert_array_equal(seen.ppm, [7.0, 9.0])
    assert seen.q.shape == (2, 3) and seen.p_m.shape == (2, 3)


@pytest.mark.parametrize("dof", [3, 5])
def test_places_within_reach_are_reached(lab, dof):
    made, rng = lab(dof), np.random.default_rng(1)
    places = made.arm.nose(np.array([made.arm.random_pose(rng) for _ in range(200)]))
    near = np.linalg.norm(places - made.arm.nose(made.arm.home), axis=1) < 0.2
    missed = np.linalg.norm(made.arm.nose(nearest_poses(view_of(made), places[near])) - places[near], axis=1)
    assert np.count_nonzero(near) > 5 and np.mean(missed < 0.005) > 0.8


@pytest.mark.parametrize(("dof", "directions"), [(1, 1), (2, 2), (3, 3), (5, 3)])
def test_the_nose_has_as_many_directions_as_joints_at_most_three(lab, dof, directions):
    arm = lab(dof).arm
    can = tangent_directions(view_of(lab(dof)), arm.home)
    np.testing.assert_allclose(can.T @ can, np.eye(directions), atol=1e-12)


@pytest.mark.parametrize("dof", [1, 2, 3, 5])
def test_a_step_the_nose_can_go_is_gone(lab, dof):
    """As far as the joints' limits let it."""
    made = lab(dof)
    p, can = made.arm.nose(made.arm.home), tangent_directions(view_of(made), made.arm.home)
    for side in np.vstack([can.T, -can.T]):
        gone = made.arm.nose(step_toward(view_of(made), p + 0.03 * side, np.random.default_rng(0))) - p
        assert gone @ side > 0.02 and np.linalg.norm(gone) < 0.035


def test_a_place_out_of_the_box_is_gone_toward(lab):
    made = lab(5)
    p = made.arm.nose(made.arm.home)
    goal = made.arm.nose(step_toward(view_of(made), p + np.array([0.0, 0.0, -1.0]), np.random.default_rng(0)))
    assert goal[2] < p[2] and np.linalg.norm(goal[:2] - p[:2]) < 0.05
