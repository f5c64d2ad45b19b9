"""Climbing: the slope of a plane is found, steps shrink without gain, and a quiet field is climbed to within a step of its top."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.core.errors import BadInput
from oio.search.gradient import Gradient
from oio.search.step_planning import box_diagonal_m
from oio.search.view import Move, View

CLIMB = Gradient(fit_sniffs=10, step=0.08, min_step=0.02, step_factor=0.7, spread=0.3)


@given(seed=st.integers(0, 2**32 - 1), r=st.integers(1, 3))
def test_the_direction_is_that_of_the_plane(seed, r):
    rng = np.random.default_rng(seed)
    slope = rng.standard_normal(r) + 0.1
    x = np.vstack([np.zeros(r), np.eye(r), -np.eye(r), rng.standard_normal((3, r))])
    np.testing.assert_allclose(CLIMB.direction(x, 2.0 + x @ slope, rng), slope / np.linalg.norm(slope), atol=1e-9)


@given(seed=st.integers(0, 2**32 - 1))
def test_turning_the_sniffs_turns_the_direction(seed):
    rng = np.random.default_rng(seed)
    x, y = rng.standard_normal((8, 3)), rng.standard_normal(8)
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    climb = replace(CLIMB, spread=0.0)  # probes go to either side by chance
    np.testing.assert_allclose(climb.direction(x @ turn.T, y, rng), turn @ climb.direction(x, y, rng), atol=1e-7)


@given(y=st.lists(st.floats(-10, 10), min_size=1, max_size=30), lift=st.floats(-5, 5))
def test_the_step_stays_within_its_limits_and_does_not_depend_on_the_strength(y, lift):
    best, step = CLIMB.climbed(np.array(y))
    assert y[best] == max(y) and CLIMB.min_step <= step <= CLIMB.step
    lifted = np.round(np.array(y), 3)
    assert CLIMB.climbed(lifted) == CLIMB.climbed(lifted + round(lift))


def test_a_move_without_gain_shrinks_the_step_and_a_gain_undoes_it():
    assert CLIMB.climbed(np.array([1.0, 0.5]))[1] == pytest.approx(0.7 * 0.08)
    assert CLIMB.climbed(np.array([1.0, 0.5, 0.4]))[1] == pytest.approx(0.49 * 0.08)
    assert CLIMB.climbed(np.array([1.0, 0.5, 0.4, 2.0]))[1] == pytest.approx(0.7 * 0.08)
    assert CLIMB.climbed(np.zeros(30))[1] == 0.02


def test_a_direction_in_which_the_sniffs_hardly_differ_is_probed():
    x = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.5, 0.01]])
    probe = CLIMB.direction(x, x @ np.array([1.0, 2.0, 0.0]), np.random.default_rng(0))
    assert abs(probe[2]) > 0.99
    assert {float(np.sign(CLIMB.direction(x, x[:, 0], np.random.default_rng(s))[2])) for s in range(20)} == {-1.0, 1.0}


def climbed(made, source, exponent, moves, seed):
    """Distances (moves,) m from the source of a climb in c = 100 r^-n, which the sensor follows at once."""
    view, rng = View(made.arm, made.model, None, (), (), dwell_s=60.0, standoff_m=0.0), np.random.default_rng(seed)
    far = []
    for _ in range(moves):
        q = CLIMB.propose(view, rng)
        far.append(float(np.linalg.norm(made.arm.nose(q) - source)))
        view = replace(view, moves=(*view.moves, Move(q, 0.0, 100.0 * far[-1] ** -exponent)))
    return np.array(far)


@pytest.mark.parametrize("dof", [3, 5])
@pytest.mark.parametrize("exponent", [1.0, 2.0])
def test_a_quiet_isotropic_field_is_climbed_to_within_a_step(lab, dof, exponent):
    made = lab(dof)
    step_m = CLIMB.step * box_diagonal_m(View(made.arm, made.model, None, (), (), dwell_s=1.0, standoff_m=0.0))
    for seed in range(6):
        source = np.random.default_rng(seed).uniform([0.24, -0.15, 0.1], [0.4, 0.15, 0.25])
        assert np.min(climbed(made, source, exponent, 40, seed)) < step_m


@pytest.mark.parametrize("dof", [1, 2])
def test_with_fewer_joints_it_climbs_to_the_nearest_the_nose_can_come(lab, dof):
    made, rng = lab(dof), np.random.default_rng(3)
    source = made.arm.nose(made.arm.random_pose(rng))
    far = climbed(made, source, 1.0, 40, 1)
    assert np.min(far) < 0.09


@pytest.mark.parametrize(("key", "value"), [("fit_sniffs", 3), ("step", 0.01), ("step_factor", 1.5), ("spread", -1.0)])
def test_senseless_settings_are_refused(key, value):
    with pytest.raises(BadInput, match=key):
        replace(CLIMB, **{key: value})
