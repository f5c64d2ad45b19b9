"""Kinematics agree with MuJoCo; limits hold; every mistake is refused in words."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.kinematics.minimum_jerk import minimum_jerk

DOFS = (1, 2, 3, 5)


@pytest.fixture(scope="module")
def physics(built):
    model = mujoco.MjModel.from_xml_path(str(built("arm").path))
    return model, mujoco.MjData(model)


def by_mujoco(physics, q):
    """Nose (3,) m and Jacobian (3, joints) at all joints q."""
    model, data = physics
    data.qpos[:] = q
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    jacobian, site = np.zeros((3, model.nv)), model.site("nose").id
    mujoco.mj_jacSite(model, data, jacobian, None, site)
    return np.array(data.site_xpos[site]), jacobian


@pytest.mark.parametrize("dof", DOFS)
def test_nose_and_jacobian_are_mujocos(built, physics, dof):
    arm, rng = built("arm", f"dof={dof}"), np.random.default_rng(dof)
    q = rng.uniform(arm.low_rad, arm.high_rad, (100, dof))
    p, jacobian = arm.nose_jacobian(q)
    for i in range(len(q)):
        p_true, j_true = by_mujoco(physics, [*q[i], *arm.home_rad[dof:]])
        np.testing.assert_allclose(p[i], p_true, atol=1e-9)
        np.testing.assert_allclose(jacobian[i], j_true[:, :dof], atol=1e-9)


def test_names_and_limits_are_the_mjcfs(built, physics):
    arm, model = built("arm"), physics[0]
    assert arm.names == tuple(model.joint(i).name for i in range(model.njnt))
    np.testing.assert_array_equal(np.column_stack([arm.low_rad, arm.high_rad]), model.jnt_range)
    assert built("arm", "dof=2").names == arm.names[:2]


def test_shoulder_is_on_the_axis_of_the_first_joint(built):
    arm = built("arm", "dof=1")
    noses = arm.nose(np.linspace(-1.5, 1.5, 9)[:, None])
    away = np.linalg.norm((noses - arm.shoulder)[:, :2], axis=1)
    np.testing.assert_allclose(away, away[0], rtol=1e-9)


def test_poses_may_come_in_any_shape(built):
    arm = built("arm", "dof=3")
    q = np.random.default_rng(0).uniform(-0.5, 0.5, (2, 4, 3))
    p, jacobian = arm.nose_jacobian(q)
    assert p.shape == (2, 4, 3) and jacobian.shape == (2, 4, 3, 3)
    np.testing.assert_array_equal(p[1, 2], arm.nose(q[1, 2]))
    with pytest.raises(ValueError, match="expected 3 joint values, got 5"):
        arm.nose(np.zeros(5))


def test_the_gantrys_joints_are_its_nose(built):
    arm = built("arm", "arm=gantry", "dof=3")
    p, jacobian = arm.nose_jacobian(np.array([1.0, 2.0, 0.5]))
    np.testing.assert_allclose(p, [1.0, 2.0, 0.5])
    np.testing.assert_allclose(jacobian, np.eye(3))
    assert arm.units == ("m", "m", "m") and built("arm", "dof=3").units == ("rad", "rad", "rad")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"dof": 4}, r"dof=4 is not on the ladder of arm 'so101'. It can be 1, 2, 3, 5. Type e.g. dof=5"),
        ({"mjcf": "no/such.xml"}, "arm.mjcf is no/such.xml, but there is no such file"),
        ({"home_rad": (0.0, 0.0)}, "arm.home_rad has 2 values, but hardware/arms/so101.xml has 5 joints"),
        ({"home_rad": (0.0, 0.0, 0.0, 0.0, 9.0)}, "arm.home_rad is .*9.0.*, but the limits are"),
        ({"joint_speed": 0.0}, "Arm.joint_speed is 0, but 0.001 to 100 is allowed"),
        ({"nose_speed_m_s": -1.0}, "Arm.nose_speed_m_s is -1, but 0.001 to 100 is allowed"),
        ({"encoder_drift_deg_s2": -1e-3}, "Arm.encoder_drift_deg_s2 is -0.001, but 0 to 10 is allowed"),
        ({"homing_offset_deg": -1.0}, "Arm.homing_offset_deg is -1, but 0 to 90 is allowed"),
        ({"backlash_deg": -1.0}, "Arm.backlash_deg is -1, but 0 to 90 is allowed"),
    ],
)
def test_a_wrong_arm_is_refused(built, changes, said):
    with pytest.raises(BadInput, match=said):
        replace(built("arm"), **changes)


@pytest.mark.parametrize(
    ("q", "said"),
    [
        ([0.0, 0.0], r"a move of \(2,\) joint values was asked for, but dof=5 takes \(5,\)"),
        ([0.0, np.nan, 0.0, 0.0, 0.0], "every joint needs a finite number"),
        ([0.0, np.inf, 0.0, 0.0, 0.0], "every joint needs a finite number"),
        ([1.92, -1.0, 0.6, 0.9, 0.0], "joints may go from"),
        ([1.9, -1.0, 0.6, 0.9, 0.0], "and the nose from"),  # within the joint's limit, outside the box
    ],
)
def test_a_wrong_move_is_refused(built, q, said):
    with pytest.raises(BadInput, match=said):
        built("arm").validated(np.array(q))


@pytest.mark.parametrize("dof", DOFS)
def test_home_and_random_poses_are_inside(built, dof):
    arm, rng = built("arm", f"dof={dof}"), np.random.default_rng(1)
    assert arm.is_allowed(arm.home)
    np.testing.assert_array_equal(arm.validated(arm.home), arm.home)
    for _ in range(20):
        p = arm.nose(arm.validated(arm.random_pose(rng)))
        assert np.all(p >= arm.box_low_m) and np.all(p <= arm.box_high_m)


@pytest.mark.parametrize("dof", DOFS)
def test_poses_drawn_at_once_are_those_drawn_one_by_one(built, dof):
    arm, at_once, singly = built("arm", f"dof={dof}"), np.random.default_rng(5), np.random.default_rng(5)
    np.testing.assert_array_equal(arm.random_poses(at_once, 30), [arm.random_pose(singly) for _ in range(30)])
    assert at_once.random() == singly.random()


def test_a_box_without_room_is_refused(built):
    arm = replace(built("arm"), box_low_m=(2.0, 2.0, 2.0), box_high_m=(3.0, 3.0, 3.0))
    with pytest.raises(BadInput, match=r"keeps the nose inside arm.box_low_m to arm.box_high_m; widen it"):
        arm.random_pose(np.random.default_rng(0))


def test_no_move_is_faster_than_the_arm_may_go(built):
    arm, rng = built("arm"), np.random.default_rng(3)
    for _ in range(20):
        a, b = arm.random_pose(rng), arm.random_pose(rng)
        over_s, x = arm.duration_s(a, b), np.linspace(0, 1, 2001)
        way = a + np.array([minimum_jerk(v) for v in x])[:, None] * (b - a)
        fastest = np.max(np.abs(np.diff(way, axis=0))) / (over_s / 2000)
        assert fastest <= arm.joint_speed * (1 + 1e-4)
    only_joints = replace(arm, nose_speed_m_s=100.0)
    assert only_joints.duration_s(a, b) == pytest.approx(1.875 * np.max(np.abs(a - b)) / arm.joint_speed)


def test_smooth_begins_and_ends_at_rest():
    assert (minimum_jerk(-1.0), minimum_jerk(0.0), minimum_jerk(0.5), minimum_jerk(1.0), minimum_jerk(2.0)) == (0.0, 0.0, 0.5, 1.0, 1.0)
    assert minimum_jerk(1e-3) < 1.1e-8 and 1.0 - minimum_jerk(1 - 1e-3) < 1.1e-8  # 10 x^3
    x = np.linspace(0, 1, 100)
    assert np.all(np.diff([minimum_jerk(v) for v in x]) > 0)


def test_reach_brings_the_nose_there_or_says_no(built):
    arm, rng = built("arm"), np.random.default_rng(4)
    reached = 0
    for _ in range(20):
        goal = arm.nose(arm.random_pose(rng))
        q = arm.solve_ik(goal, arm.home)
        if q is not None:
            reached += 1
            assert arm.is_allowed(q) and np.linalg.norm(arm.nose(q) - goal) < 0.005
    assert reached >= 15
    assert arm.solve_ik(np.array([2.0, 0.0, 0.3]), arm.home) is None


@pytest.mark.parametrize("dof", [3, 5])
def test_places_reached_together_are_those_reached_one_by_one(built, dof):
    """Each from its own joints; what cannot be reached is said, and the joints that are given stay within limits."""
    arm, rng = built("arm", f"dof={dof}"), np.random.default_rng(5)
    near = np.array([arm.nose(arm.random_pose(rng)) for _ in range(12)])
    goals = np.vstack([near, [[2.0, 0.0, 0.3], [0.0, 0.0, -1.0]], arm.nose(arm.random_pose(rng))[None]])
    begin = np.array([arm.random_pose(rng) for _ in goals])
    before = begin.copy()
    q, there = arm.solve_ik_all(goals, begin)
    assert q.shape == (15, dof) and there.shape == (15,) and there.dtype == np.bool_
    assert not there[12] and not there[13] and np.count_nonzero(there) >= 8
    np.testing.assert_array_equal(begin, before)
    for i, goal in enumerate(goals):
        alone = arm.solve_ik(goal, begin[i])
        assert (alone is not None) == there[i]
        if alone is not None:
            np.testing.assert_array_equal(alone, q[i])
            assert arm.is_allowed(q[i]) and np.linalg.norm(arm.nose(q[i]) - goal) < 0.005
    assert np.all((q >= arm.low_rad) & (q <= arm.high_rad))


def test_a_place_outside_the_box_is_not_reached(built):
    """The nose could get there, but may not."""
    arm, rng = built("arm"), np.random.default_rng(6)
    goals = np.array([arm.nose(arm.random_pose(rng)) for _ in range(20)])
    begin = np.tile(arm.home, (20, 1))
    lower = replace(arm, box_high_m=(*arm.box_high_m[:2], float(np.median(goals[:, 2]))))
    (q, there), (_, low) = arm.solve_ik_all(goals, begin), lower.solve_ik_all(goals, begin)
    np.testing.assert_array_equal(low, there & (arm.nose(q)[:, 2] <= lower.box_high_m[2]))
    assert 0 < np.count_nonzero(low) < np.count_nonzero(there)


def test_no_place_is_reached_at_once(built):
    arm = built("arm")
    q, there = arm.solve_ik_all(np.zeros((0, 3)), np.zeros((0, 5)))
    assert q.shape == (0, 5) and there.shape == (0,)


def test_many_ways_are_judged_as_each_alone(built):
    """`free`, `clearance_m` and `duration_s`: goals may come in any shape."""
    arm, rng = built("arm"), np.random.default_rng(7)
    here, p = arm.home, np.array([0.3, 0.1, 0.2])
    goals = rng.uniform(arm.low_rad, arm.high_rad, (4, 6, 5))
    free, clear, lasts = arm.path_is_free(here, goals), arm.clearance_m(here, goals, p), arm.duration_s(here, goals)
    assert free.shape == clear.shape == lasts.shape == (4, 6) and 0 < np.count_nonzero(free) < 24
    for i in np.ndindex(4, 6):
        assert free[i] == arm.path_is_free(here, goals[i])
        assert clear[i] == pytest.approx(float(arm.clearance_m(here, goals[i], p)), rel=1e-12)
        assert lasts[i] == pytest.approx(float(arm.duration_s(here, goals[i])), rel=1e-12)


def test_clearance_is_the_nearest_point_of_the_way(built):
    arm = built("arm")
    a, b = arm.home, arm.home + np.array([0.6, 0.0, 0.0, 0.0, 0.0])
    on_the_way = arm.nose(a + 0.75 * (b - a))
    assert arm.clearance_m(a, b, on_the_way) < 1e-9
    assert arm.clearance_m(a, b, arm.nose(a)) == pytest.approx(np.linalg.norm(arm.nose(a + 0.25 * (b - a)) - arm.nose(a)))
