"""A measurement is where it is said to be, or there is none."""

import numpy as np
import pytest

from oio.core.errors import NotObservable
from oio.search.measurement_pose import measurement_pose

BEACON_M = np.array([0.33, 0.10, 0.16])


def never(goal):
    return False


@pytest.mark.parametrize("distance_m", [0.05, 0.12, 0.25])
def test_the_nose_is_at_its_distance_and_came_no_nearer(built, distance_m):
    arm = built("arm", "dof=5")
    for seed in range(10):
        pose = measurement_pose(arm, arm.home, BEACON_M, distance_m, 0.045, never, np.random.default_rng(seed))
        assert np.linalg.norm(arm.nose(pose) - BEACON_M) == pytest.approx(distance_m, abs=0.006)
        assert arm.is_allowed(pose) and arm.clearance_m(arm.home, pose, BEACON_M) >= min(0.045, 0.9 * distance_m)


def test_an_arm_that_is_folded_away_from_the_source_finds_a_pose_too(built):
    """Inverse kinematics from where it stood found none of 400 directions; a run of the default configuration ended there."""
    arm, folded = built("arm", "dof=5"), np.array([-0.29725907, 0.9736792, -1.31382769, -0.08949563, -0.03244201])
    pose = measurement_pose(arm, folded, BEACON_M, 0.05, 0.045, lambda _: True, np.random.default_rng(0))
    assert np.linalg.norm(arm.nose(pose) - BEACON_M) == pytest.approx(0.05, abs=0.006) and arm.is_allowed(pose)


@pytest.mark.parametrize("distance_m", [0.8, 2.0])
def test_a_distance_that_is_out_of_reach_is_refused_not_faked(built, distance_m):
    """It used to give the pose where the nose happened to be, and a measurement there passed for one at this distance."""
    arm = built("arm", "dof=5")
    with pytest.raises(NotObservable, match=rf"nose {distance_m:g} m from the source at \[0.33, 0.1, 0.16\].*beacon.position"):
        measurement_pose(arm, arm.home, BEACON_M, distance_m, 0.045, never, np.random.default_rng(0))


def test_where_no_straight_path_is_free_the_planner_is_asked(built, monkeypatch):
    arm, asked = built("arm", "dof=5"), []
    monkeypatch.setattr(type(arm), "path_is_free", lambda *_: np.bool_(False))

    def planned(goal):
        asked.append(goal)
        return len(asked) == 3

    pose = measurement_pose(arm, arm.home, BEACON_M, 0.12, 0.045, planned, np.random.default_rng(0))
    assert len(asked) >= 3 and pose is asked[-1]


@pytest.mark.parametrize("dof", [1, 2])
def test_an_arm_that_cannot_choose_its_distance_goes_anywhere(built, dof):
    arm = built("arm", f"dof={dof}")
    pose = measurement_pose(arm, arm.home, BEACON_M, 0.05, 0.045, never, np.random.default_rng(0))
    assert arm.is_allowed(pose)
