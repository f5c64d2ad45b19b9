"""Before a declaration the nose goes where another source would show, until enough of the box was tested."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.core.records import Belief
from oio.inference.sampling import halton
from oio.search.elsewhere import PLACES, LookElsewhere
from oio.search.view import Move, View

RULE = LookElsewhere(below_sd_m=0.01, covered=0.6, least_gain=0.03, sniffs=1, whiff_sigmas=8.0, contrast=1.0)
HERE = np.array([0.30, 0.10, 0.18])


@pytest.fixture
def searching(lab):
    """A view in wind of 20 / m along x, or in still air, of a source that was found, of 50 ppm at 0.1 m."""

    def view(wind=20.0, sd_m=0.005, moves=(), dof=5):
        made = lab(dof)
        at = made.model.at
        mean, cov = np.zeros(made.model.size), 1e-9 * np.eye(made.model.size)
        mean[at["s"]], mean[at["l"]], mean[at["n"]], mean[at["k"]] = HERE, np.log(50.0), 1.0, [wind, 0.0, 0.0]
        cov[at["s"], at["s"]] = sd_m**2 / 3.0 * np.eye(3)
        return View(made.arm, made.model, Belief(0, mean, cov), (), tuple(moves), 0.3, 0.04)

    return view


def shares(view):
    """Share of the box that was tested, and that which each further proposal adds, until there is none."""
    places = np.array(view.arm.box_low_m) + halton(PLACES) * np.subtract(view.arm.box_high_m, view.arm.box_low_m)
    rng, tested = np.random.default_rng(0), []
    while True:
        shown = RULE._would_show(view, np.array([move.q for move in view.moves]), places)
        tested.append(float(np.mean(np.any(shown, axis=0))))
        pose = RULE.propose(view, rng)
        if pose is None:
            return tested
        assert view.arm.is_allowed(pose)
        view = replace(view, moves=(*view.moves, Move(pose, 0.0, 0.0)))


def test_every_sniff_tests_more_of_the_box_until_it_is_enough(searching):
    here = Move(searching().arm.home, 0.1, 5.0)
    tested = shares(searching(moves=(here,)))
    assert len(tested) > 3 and tested == sorted(tested)
    assert all(after >= before + RULE.least_gain for before, after in pairwise(tested))


def test_in_still_air_a_few_sniffs_have_tested_it_all(searching):
    rng = np.random.default_rng(1)
    view = searching(wind=0.0)
    far = [q for q in view.arm.random_poses(rng, 60) if np.linalg.norm(view.arm.nose(q) - HERE) > 0.1][:12]
    assert RULE.propose(replace(view, moves=tuple(Move(q, 0.1, 5.0) for q in far)), rng) is None


@pytest.mark.parametrize("change", [{"sd_m": 0.03}, {"dof": 2}])
def test_it_waits_for_a_narrow_belief_and_for_joints(searching, change):
    view = searching(moves=(Move(searching(**change).arm.home, 0.1, 5.0),), **change)
    assert RULE.propose(view, np.random.default_rng(0)) is None


def test_a_source_too_weak_to_show_anywhere_is_looked_for_nowhere(searching):
    view = searching(moves=(Move(searching().arm.home, 0.1, 5.0),))
    mean = np.array(view.belief.mean)
    mean[view.model.at["l"]] = -20.0
    assert RULE.propose(replace(view, belief=Belief(0, mean, view.belief.cov)), np.random.default_rng(0)) is None


def test_senseless_settings_are_refused():
    with pytest.raises(BadInput, match=r"LookElsewhere\.covered is 2"):
        replace(RULE, covered=2.0)
