"""Sources stand where the nose can come near them; others are refused with what to type."""

from dataclasses import replace

import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.gas.source import reachable, unlocked


def test_a_given_place_is_kept(built):
    beacon, arm = built("beacon"), built("arm")
    np.testing.assert_array_equal(beacon.placed("beacon", arm, np.random.default_rng(0)), beacon.position)


@pytest.mark.parametrize("dof", [1, 2, 3, 5])
def test_the_place_does_not_hang_on_the_dof(built, dof):
    source = built("source")
    places = [source.placed("source", built("arm", f"dof={d}"), np.random.default_rng(7)) for d in (dof, 5)]
    np.testing.assert_array_equal(*places)


def test_drawn_places_are_in_the_box_and_in_reach(built):
    source, arm = built("source"), built("arm")
    drawn = np.array([source.placed("source", arm, np.random.default_rng(seed)) for seed in range(10)])
    assert np.all(drawn >= source.box_low_m) and np.all(drawn <= source.box_high_m)
    assert len(np.unique(drawn[:, 0])) == 10
    assert all(reachable(arm, place, source.approach_m) for place in drawn)


def test_a_reachable_place_has_a_pose_that_near(built):
    arm, place = unlocked(built("arm", "dof=1")), np.array([0.33, 0.10, 0.16])
    assert arm.dof == 5 and reachable(arm, place, 0.045)
    rng = np.random.default_rng(0)
    nearest = min(np.linalg.norm(arm.nose(arm.random_pose(rng)) - place) for _ in range(20_000))
    assert nearest < 0.045


@pytest.mark.parametrize("position", [(1.5, 0.0, 0.2), (-0.3, 0.0, 0.2), (0.3, 0.0, 1.2)])
def test_a_place_out_of_reach_is_refused_in_words(built, position):
    away, arm = replace(built("beacon"), position=position), built("arm")
    with pytest.raises(BadInput) as refused:
        away.placed("beacon", arm, np.random.default_rng(0))
    said = str(refused.value)
    assert said.startswith(f"beacon.position is {list(position)}, {np.linalg.norm(position):.2f} m from the base")
    assert "cannot come within 0.045 m of it" in said and "Type e.g. beacon.position=[0.30,0.10,0.15]" in said


def test_the_place_that_the_error_recommends_is_good(built):
    good = replace(built("beacon"), position=(0.30, 0.10, 0.15))
    assert good.placed("beacon", built("arm"), np.random.default_rng(0)) is not None


@pytest.mark.slow
def test_a_box_out_of_reach_is_refused(built):
    away = replace(built("source"), box_low_m=(2.0, 2.0, 2.0), box_high_m=(3.0, 3.0, 3.0))
    with pytest.raises(BadInput, match=r"no place in source.box_low_m .* is within reach of 'so101'"):
        away.placed("source", built("arm"), np.random.default_rng(0))


def test_strength_is_given_or_drawn_about_one(built):
    source = replace(built("source"), strength=0.0, strength_spread=0.4)
    ln = np.log([source.strength_drawn(np.random.default_rng(seed)) for seed in range(2000)])
    assert np.mean(ln) == pytest.approx(0.0, abs=0.04) and np.std(ln) == pytest.approx(0.4, rel=0.1)
    assert replace(source, strength=2.0).strength_drawn(np.random.default_rng(0)) == 2.0
