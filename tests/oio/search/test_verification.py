"""Before a declaration the nose goes where another hypothesis has the source, and only there."""

from dataclasses import replace

import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.core.records import Belief
from oio.inference.map_fit import Fit
from oio.search.verification import VAGUE, Verification
from oio.search.view import Move, View

RULE = Verification(below_sd_m=0.02, radius_m=0.065, sniffs=2, distances_m=(0.045, 0.055))
HERE, THERE = np.array([0.30, 0.10, 0.18]), np.array([0.33, -0.10, 0.20])


@pytest.fixture
def searching(lab):
    made = lab(5)

    def view(others=(THERE,), sd_m=0.005, moves=(), others_sd_m=0.01):
        def fit(place):
            mean = np.array(made.mean)
            mean[:3] = place
            cov = np.array(made.cov)
            cov[:3, :] = cov[:, :3] = 0.0
            cov[:3, :3] = others_sd_m**2 / 3.0 * np.eye(3)
            return Fit(made.layout, mean, cov, 0.0, 0.0, made.model.fluctuation, 1, made.law)

        at = made.model.at
        mean, cov = np.zeros(made.model.size), 1e-9 * np.eye(made.model.size)
        mean[at["s"]] = HERE
        cov[at["s"], at["s"]] = sd_m**2 / 3.0 * np.eye(3)
        return View(made.arm, made.model, Belief(0, mean, cov), tuple(map(fit, (HERE, *others))), tuple(moves), 0.3, 0.04)

    return view


def sniffs_at(view, place, count):
    q = view.arm.solve_ik(place + np.array([-0.05, 0.0, 0.0]), view.arm.home)
    return [Move(q, 0.1, 5.0)] * count


def test_it_goes_next_to_the_other_hypothesis(searching):
    view = searching()
    pose = RULE.propose(view, np.random.default_rng(0))
    assert np.linalg.norm(view.arm.nose(pose) - THERE) == pytest.approx(0.05, abs=0.008)
    assert view.arm.is_allowed(pose)


@pytest.mark.parametrize("change", [{"others": ()}, {"sd_m": 0.03}])
def test_there_is_nothing_to_verify_with_one_hypothesis_or_a_vague_one(searching, change):
    assert RULE.propose(searching(**change), np.random.default_rng(0)) is None


def test_a_place_that_was_sniffed_often_enough_is_left_alone(searching):
    plain = searching()
    once, twice = (searching(moves=sniffs_at(plain, THERE, count)) for count in (1, 2))
    assert RULE.propose(once, np.random.default_rng(0)) is not None
    assert RULE.propose(twice, np.random.default_rng(0)) is None


def test_a_vague_hypothesis_gets_more_sniffs(searching):
    plain = searching()
    some, many = (searching(moves=sniffs_at(plain, THERE, RULE.sniffs * share), others_sd_m=0.05) for share in (VAGUE - 1, VAGUE))
    assert RULE.propose(some, np.random.default_rng(0)) is not None
    assert RULE.propose(many, np.random.default_rng(0)) is None


def test_the_next_hypothesis_gets_its_turn(searching):
    further = np.array([0.25, 0.0, 0.25])
    view = searching(others=(THERE, further), moves=sniffs_at(searching(), THERE, 2))
    assert np.linalg.norm(view.arm.nose(RULE.propose(view, np.random.default_rng(0))) - further) < 0.065


def test_what_is_out_of_reach_stops_nothing(searching):
    assert RULE.propose(searching(others=(np.array([2.0, 2.0, 2.0]),)), np.random.default_rng(0)) is None


def test_before_the_first_map_there_is_no_hypothesis(searching):
    assert RULE.propose(replace(searching(), belief=None, hypotheses=()), np.random.default_rng(0)) is None


def test_senseless_settings_are_refused():
    with pytest.raises(BadInput, match=r"Verification\.radius_m is 0"):
        replace(RULE, radius_m=0.0)
