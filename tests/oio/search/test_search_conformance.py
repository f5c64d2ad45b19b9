"""Every search in conf/ keeps its promises: with any number of joints, on a gantry, at the start, later, and with a belief."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from oio.core.records import Belief
from oio.gas.range_law import LAW
from oio.search.view import Move, View
from oio.testing import check_strategy

SEARCHES = sorted(path.stem for path in (Path(__file__).resolve().parents[3] / "conf" / "search").glob("*.yaml"))
OWN = ["cast_surge", "gradient", "infotaxis", "random"]  # these promise to keep off the source and in the box on the way as well
ARMS = [("so101", 1), ("so101", 2), ("so101", 3), ("so101", 5), ("gantry", 1), ("gantry", 2), ("gantry", 3)]


def begun(built, lab, name, dof):
    """A view of an arm at rest."""
    arm = built("arm", f"arm={name}", f"dof={dof}")
    return View(arm, replace(lab(min(dof, 3)).model, arm=arm), None, (), (), dwell_s=1.0, standoff_m=0.04)


def walked(view, moves=7):
    """The same view after moves that smelt something on the way, nothing, and were too short to tell."""
    rng, q, made = np.random.default_rng(1), view.arm.home, []
    while len(made) < moves:
        goal = view.arm.random_pose(rng)
        if view.arm.path_is_free(q, goal):
            bouts, ppm = float(rng.choice([0.0, 0.1, 0.5])), float(rng.choice([0.0, -0.02, 0.5, 20.0]))
            made.append(Move(goal, bouts, ppm, 0.5 * (q + goal) if bouts > 0.0 else None, ppm <= 0.0))
            q = goal
    return replace(view, moves=tuple(made))


def windy(view):
    """The same view once calibration has found wind."""
    law = np.zeros(LAW)
    law[4], law[5:8] = view.model.law.exponent, [25.0, -30.0, 5.0]
    return replace(view, law=law)


def believing(view, away_m=0.06):
    """The same view with a belief: a source near the nose, joint offsets, a little wind."""
    at, mean = view.model.at, np.zeros(view.model.size)
    mean[at["o"]] = 0.01
    mean[at["s"]] = view.arm.nose(view.moves[-1].q - 0.01) + away_m * np.array([0.6, 0.8, 0.0])
    mean[at["l"]], mean[at["n"]], mean[at["k"]] = 3.0, 1.0, [4.0, -2.0, 0.0]
    return replace(view, belief=Belief(0, mean, 1e-4 * np.eye(len(mean))))


@pytest.mark.parametrize("search", SEARCHES)
@pytest.mark.parametrize(("name", "dof"), ARMS)
def test_promises_are_kept_at_the_start_later_and_with_a_belief(built, lab, search, name, dof):
    strategy, view = built("search", f"search={search}"), begun(built, lab, name, dof)
    for seen in (view, walked(view), windy(view), windy(walked(view)), believing(windy(walked(view)))):
        check_strategy(strategy, seen)


@pytest.mark.parametrize("search", OWN)
@pytest.mark.parametrize(("name", "dof"), ARMS)
def test_the_nose_stays_in_its_box_on_the_way(built, lab, search, name, dof):
    strategy, view = built("search", f"search={search}"), walked(begun(built, lab, name, dof))
    for seed in range(5):
        for seen in (view, believing(view)):
            goal = strategy.propose(seen, np.random.default_rng(seed))
            assert seen.arm.is_allowed(goal) and seen.arm.path_is_free(seen.moves[-1].q, goal)


@pytest.mark.parametrize("search", OWN)
@pytest.mark.parametrize("standoff_m", [0.04, 0.1])
@pytest.mark.parametrize("dof", [3, 5])
def test_the_nose_keeps_off_the_believed_source(built, lab, search, standoff_m, dof):
    """Also from within near_m of it, where a belief that moved may have left the nose."""
    strategy = built("search", f"search={search}")
    view = replace(believing(walked(begun(built, lab, "so101", dof))), standoff_m=standoff_m)
    o, source = view.belief.mean[view.model.at["o"]], view.belief.mean[view.model.at["s"]]
    for seed in range(8):
        goal = strategy.propose(view, np.random.default_rng(seed))
        assert view.arm.clearance_m(view.moves[-1].q - o, goal - o, source) >= standoff_m - 1e-9


@pytest.mark.parametrize("search", OWN)
def test_where_nothing_keeps_off_the_nose_goes_as_far_as_it_can(built, lab, search):
    strategy, view = built("search", f"search={search}"), replace(believing(walked(begun(built, lab, "so101", 3))), standoff_m=5.0)
    source, here = view.belief.mean[view.model.at["s"]], view.moves[-1].q
    goal = strategy.propose(view, np.random.default_rng(0))
    assert view.arm.path_is_free(here, goal)
    assert np.linalg.norm(view.arm.nose(goal) - source) > np.linalg.norm(view.arm.nose(here) - source)


def test_random_goes_everywhere(built, lab):
    view, strategy = begun(built, lab, "gantry", 3), built("search", "search=random")
    noses = view.arm.nose(np.array([strategy.propose(view, np.random.default_rng(seed)) for seed in range(200)]))
    size = np.array(view.arm.box_high_m) - view.arm.box_low_m
    np.testing.assert_allclose(np.mean(noses, axis=0), view.arm.box_low_m + size / 2, atol=0.1 * np.max(size))
    np.testing.assert_allclose(np.std(noses, axis=0), size / np.sqrt(12.0), rtol=0.15)
