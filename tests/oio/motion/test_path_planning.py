"""Ways: the nose stays in its box, all legs are joined, straight where that will do, and where there is none that is said."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.core.errors import BadInput
from oio.kinematics.minimum_jerk import minimum_jerk
from oio.motion.path_planning import COARSE_CHECKS, MIN_SEGMENT_S, TOLERANCE_M, _straight, box_violation_m, duration_s, joints_at, plan

pytestmark = pytest.mark.long

SEEDS = st.integers(0, 10_000)


def noses(arm, way, count=400):
    """Places (k, 3) along the way."""
    return arm.nose(np.array([joints_at(way, t_s) for t_s in np.linspace(0.0, duration_s(way), count)]))


def of(arm, seed):
    return arm.random_poses(np.random.default_rng(seed), 2)


def planned_or_none(arm, a, b, **more):
    try:
        return plan(arm, a, b, **more)
    except BadInput:
        return None


@pytest.mark.parametrize("dof", [1, 2, 3, 5])
def test_the_nose_stays_in_its_box_and_the_legs_are_joined(built, dof):
    arm = built("arm", f"dof={dof}")

    @given(SEEDS)
    def stays(seed):
        a, b = of(arm, seed)
        way = planned_or_none(arm, a, b)
        if way is None:
            assert not arm.path_is_free(a, b)
            return
        assert box_violation_m(arm, noses(arm, way)) <= TOLERANCE_M + 5e-5
        np.testing.assert_array_equal(way[0].start, a)
        for leg, after in zip(way, (*(leg.start for leg in way[1:]), b), strict=True):
            np.testing.assert_allclose(leg.start + leg.delta, after, atol=1e-12)
        np.testing.assert_allclose([joints_at(way, 0.0), joints_at(way, duration_s(way))], [a, b], atol=1e-12)

    stays()


@given(SEEDS)
def test_straight_where_that_will_do_in_the_time_the_arm_plans_to_the_bit(built, seed):
    arm = built("arm", "dof=5")
    a, b = of(arm, seed)
    inside = box_violation_m(arm, arm.nose(a + np.linspace(0.0, 1.0, 2001)[:, None] * (b - a))) <= 0.0
    if inside:
        (leg,) = plan(arm, a, b)
        assert leg.over_s == max(float(arm.duration_s(a, b)), MIN_SEGMENT_S)
        np.testing.assert_array_equal(leg.delta, b - a)


@pytest.mark.parametrize("size", [0.03, 0.3, 3.0])
def test_what_is_looked_at_in_places_is_so_in_between(built, size):
    """How far out the nose gets, and how fast it is, against two thousand places."""
    arm, rng = built("arm", "dof=5"), np.random.default_rng(4)
    shares = np.array([minimum_jerk(x) for x in np.linspace(0.0, 1.0, 2001)])[:, None]
    for _ in range(60):
        a = arm.random_pose(rng)
        b = a + size * rng.uniform(-1.0, 1.0, arm.dof)
        leg, seen_m = _straight(arm, a, b)
        nose = arm.nose(a + shares * (b - a))
        assert box_violation_m(arm, nose) == pytest.approx(seen_m, abs=5e-5)
        assert np.max(np.linalg.norm(np.diff(nose, axis=0), axis=1)) * 2000 == pytest.approx(leg.peak_m, rel=2e-3)


def test_a_round_trip_takes_as_long_either_way(built):
    arm = built("arm", "dof=3")
    for seed in range(30):
        a, b = of(arm, seed)
        there, back = planned_or_none(arm, a, b), planned_or_none(arm, b, a)
        assert (there is None) == (back is None)
        if there is not None and len(there) == len(back) == 1:
            assert duration_s(there) == pytest.approx(duration_s(back), rel=1e-9)


@pytest.mark.parametrize("coarse", [COARSE_CHECKS, 2])
def test_over_a_ceiling_that_is_too_low_the_way_goes_round(built, monkeypatch, coarse):
    """And what was thought of coarsely is looked at closely, be it ever so coarse."""
    monkeypatch.setattr("oio.motion.path_planning.COARSE_CHECKS", coarse)
    arm = replace(built("arm", "dof=3"), box_high_m=(0.58, 0.45, 0.20))
    round_about = [planned_or_none(arm, *of(arm, seed)) for seed in range(100) if not arm.path_is_free(*of(arm, seed))]
    found = [way for way in round_about if way is not None]
    assert len(found) > 3 and all(len(way) in (2, 3) for way in found)
    for way in found:
        assert box_violation_m(arm, noses(arm, way)) <= TOLERANCE_M + 5e-5
        q = np.array([joints_at(way, t_s) for t_s in np.linspace(0.0, duration_s(way), 1000)])
        assert np.max(np.abs(np.diff(q, axis=0))) <= 1.001 * arm.joint_speed * duration_s(way) / 999


def test_the_same_poses_have_the_same_way(built):
    arm = replace(built("arm", "dof=3"), box_high_m=(0.58, 0.45, 0.20))
    for a, b in (of(arm, seed) for seed in range(40)):
        first, second = planned_or_none(arm, a, b), planned_or_none(arm, a, b)
        assert (first is None) == (second is None)
        if first is not None:
            assert [leg.over_s for leg in first] == [leg.over_s for leg in second]


def test_a_bent_way_is_slowed_to_the_limit_of_the_nose(built):
    arm = built("arm", "dof=3")
    slow = replace(arm, nose_limit_m_s=0.2)  # half of what `duration_s` plans by
    for seed in range(10):
        a, b = of(arm, seed)
        way = planned_or_none(slow, a, b)
        if way is None or len(way) > 1:
            continue
        p, over_s = noses(slow, way, 4001), duration_s(way)
        assert np.max(np.linalg.norm(np.diff(p, axis=0), axis=1)) / (over_s / 4000) == pytest.approx(0.2, rel=3e-3)
        assert over_s > arm.duration_s(a, b)


def test_a_goal_without_a_path_is_refused(built):
    arm = built("arm", "dof=3")
    with pytest.raises(BadInput, match=r"no path was found from \[0.0, -1.0, 0.6\] to .* it leaves that by \d+ mm. Ask for .*dof=5"):
        plan(arm, arm.home, np.array([1.783, -1.518, -1.527]))


def test_one_joint_has_one_path(built):
    """Its arc bows over the front of a box that both ends are in."""
    arm = replace(built("arm", "dof=1"), box_high_m=(0.32, 0.45, 0.50))
    a, b = np.array([-0.4]), np.array([0.4])
    assert arm.is_allowed(a) and arm.is_allowed(b)
    with pytest.raises(BadInput, match="leaves that by 16 mm"):
        plan(arm, a, b)
