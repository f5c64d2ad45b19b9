"""The arms that ship beside the SO-101 are those of their makers' Denavit-Hartenberg tables, which are written down here once more."""

import numpy as np
import pytest

from oio.motion.path_planning import duration_s, plan

FLANGE_TO_NOSE_M = 0.1
XARM_A2_M, XARM_ANGLE = np.hypot(0.2845, 0.0535), np.arctan2(0.2845, 0.0535)
UP = np.pi / 2

# a [m], alpha [rad], d [m], offset of theta [rad]
STANDARD = {  # T_i = Rz(theta) Tz(d) Tx(a) Rx(alpha)
    "ur5e": [(0, UP, 0.1625, 0), (-0.425, 0, 0, 0), (-0.3922, 0, 0, 0), (0, UP, 0.1333, 0), (0, -UP, 0.0997, 0), (0, 0, 0.0996, 0)],
}
MODIFIED = {  # Craig: T_i = Rx(alpha) Tx(a) Rz(theta) Tz(d), with alpha and a of the link before
    "franka": [
        (0, 0, 0.333, 0), (0, -UP, 0, 0), (0, UP, 0.316, 0), (0.0825, UP, 0, 0), (-0.0825, -UP, 0.384, 0), (0, UP, 0, 0), (0.088, UP, 0, 0),
        (0, 0, 0.107, None),  # the flange does not turn
    ],
    "xarm6": [
        (0, 0, 0.267, 0), (0, -UP, 0, -XARM_ANGLE), (XARM_A2_M, 0, 0, XARM_ANGLE), (0.0775, -UP, 0.3425, 0), (0, UP, 0, 0),
        (0.076, -UP, 0.097, 0),
    ],
}  # fmt: skip
LIMITS = {
    "franka": (
        (-2.8973, 2.8973),
        (-1.7628, 1.7628),
        (-2.8973, 2.8973),
        (-3.0718, -0.0698),
        (-2.8973, 2.8973),
        (-0.0175, 3.7525),
        (-2.8973, 2.8973),
    ),
    "xarm6": ((-6.2832, 6.2832), (-2.0595, 2.0944), (-3.9270, 0.1920), (-6.2832, 6.2832), (-1.6930, 3.1416), (-6.2832, 6.2832)),
}


def turn_z(angle, along):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, along], [0, 0, 0, 1]])


def turn_x(angle, along):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0, along], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]])


def nose_by_table(name, q):
    """Position of the nose (3,) m by the table alone."""
    angles = iter(q)
    pose = turn_z(np.pi, 0.0) if name == "ur5e" else np.eye(4)  # x to the front, as ROS's base_link
    for a, alpha, d, offset in STANDARD.get(name) or MODIFIED[name]:
        joint = turn_z(0.0 if offset is None else next(angles) + offset, d)
        pose = pose @ (joint @ turn_x(alpha, a) if name in STANDARD else turn_x(alpha, a) @ joint)
    return (pose @ turn_z(0.0, FLANGE_TO_NOSE_M))[:3, 3]


@pytest.mark.parametrize("name", [*STANDARD, *MODIFIED])
def test_the_nose_is_where_the_table_puts_it(built, name):
    arm = built("arm", f"arm={name}", f"dof={7 if name == 'franka' else 6}")
    low, high = arm.model.low, arm.model.high
    rng = np.random.default_rng(0)
    for _ in range(50):
        q = rng.uniform(low, high)
        assert np.allclose(arm.nose(q), nose_by_table(name, q), atol=1e-9)


@pytest.mark.parametrize("name", LIMITS)
def test_limits_are_the_makers(built, name):
    arm = built("arm", f"arm={name}", "dof=3")
    assert np.allclose(np.stack((arm.model.low, arm.model.high), axis=1), LIMITS[name], atol=5e-4)


@pytest.mark.parametrize("name", [*STANDARD, *MODIFIED])
def test_its_ladder_is_the_papers_and_all_joints(built, name):
    n = 7 if name == "franka" else 6
    arm = built("arm", f"arm={name}", f"dof={n}")
    assert arm.rungs == (1, 2, 3, n)
    assert np.allclose(arm.nose(arm.home), (0.34, 0.0, 0.15), atol=2e-3)
    assert built("bout").window(n) == 2 * n + 1
    with pytest.raises(Exception, match=f"dof=4 is not on the ladder of arm '{name}'. It can be 1, 2, 3, {n}"):
        built("arm", f"arm={name}", "dof=4")


def test_a_ladder_must_rise(built):
    with pytest.raises(Exception, match=r"its rungs must rise, from 1 at least to the 5 joints"):
        built("arm", "arm.ladder=[1,3,2,5]")
    assert built("arm", "arm.ladder=null").rungs == (1, 2, 3, 5)


@pytest.mark.parametrize("name", [*STANDARD, *MODIFIED])
def test_random_poses_are_in_one_configuration_so_that_paths_lead_from_each_to_each(built, name):
    """Drawn anywhere within limits, 22 to 38 of 40 pairs of an arm with six joints that turn on had no path."""
    n = 7 if name == "franka" else 6
    arm = built("arm", f"arm={name}", f"dof={n}")
    poses = arm.random_poses(np.random.default_rng(1), 30)
    assert np.all(np.abs(poses - arm.home) <= arm.random_span_rad)
    for start, goal in poses.reshape(-1, 2, n):
        assert duration_s(plan(arm, start, goal)) < 15.0
    across = np.ptp(arm.nose(arm.random_poses(np.random.default_rng(2), 200)), axis=0)
    assert np.all(across > 0.8 * np.subtract(arm.box_high_m, arm.box_low_m))  # and yet the nose goes all over the box


def test_where_the_limits_say_enough_poses_are_drawn_from_all_of_them(built):
    arm = built("arm", "dof=5")
    assert arm.random_span_rad is None
    assert np.any(np.abs(arm.random_poses(np.random.default_rng(0), 200) - arm.home) > 1.5)
