"""When a map is due: after exploring, then ever more seldom, sooner in doubt, and when a lost plume is found again."""

from dataclasses import replace

import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.search.mapping_policy import MappingPolicy
from oio.search.view import Move

POLICY = MappingPolicy(
    explore_moves=6, min_whiffs=3, explore_max_moves=10, lost_moves=2, remap_factor=1.5, recheck_moves=3, thorough_factor=2.0
)


def moves(script):
    """A letter per move: w had a whiff, . was silent, - neither."""
    return [Move(np.zeros(3), 0.0, 0.0, np.zeros(3) if letter == "w" else None, letter == ".") for letter in script]


@pytest.mark.parametrize(
    ("script", "due"),
    [("wwwww", False), ("www---", True), ("ww----", False), ("ww---------", True), ("----------", True), ("---------", False)],
)
def test_the_first_map_wants_moves_and_whiffs_but_not_for_ever(script, due):
    assert POLICY.due(moves(script), 0, False) is due


@pytest.mark.parametrize(("after", "due"), [(8, False), (9, True), (12, True)])
def test_later_maps_come_after_so_many_times_the_moves(after, due):
    assert POLICY.due(moves("w" * after), 6, False) is due


@pytest.mark.parametrize("recheck", [1, 3, 7])
def test_in_doubt_a_map_comes_after_exactly_so_many_moves(recheck):
    """From 40 moves on the factor alone would wait for 20 more."""
    policy = replace(POLICY, recheck_moves=recheck)
    due = [policy.due(moves("w" * count), 40, True) for count in range(41, 41 + 2 * recheck)]
    assert due == [count >= 40 + recheck for count in range(41, 41 + 2 * recheck)]
    assert not any(policy.due(moves("w" * count), 40, False) for count in range(41, 41 + 2 * recheck))


def test_a_plume_that_is_found_again_is_mapped_at_once():
    assert POLICY.due(moves("wwwwww..w"), 8, False) and not POLICY.due(moves("wwwwww.w"), 7, False)
    assert not POLICY.due(moves("wwwwww.."), 7, False)


@pytest.mark.parametrize(
    "changed", [{"explore_moves": 3}, {"explore_max_moves": 5}, {"lost_moves": 0}, {"remap_factor": 0.9}, {"recheck_moves": 0}]
)
def test_a_policy_that_cannot_map_is_refused(changed):
    with pytest.raises(BadInput, match=f"MappingPolicy.{next(iter(changed))}"):
        replace(POLICY, **changed)


def test_every_alternative_is_fitted_ever_more_seldom():
    assert [POLICY.thorough(moves, 10) for moves in (10, 19, 20, 50)] == [False, False, True, True]
    assert POLICY.thorough(6, 0)
