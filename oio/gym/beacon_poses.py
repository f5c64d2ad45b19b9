"""Poses at a beacon: the allowed one whose nose comes nearest to a target."""

import numpy as np

from oio.core.records import Array
from oio.kinematics.arm import Arm

AROUND, ANYWHERE = 24, 48  # candidates about the target, and in the whole box
SPREAD = 0.3  # of those about the target, over its distance from the beacon
SPAN = 0.22  # of the diagonal of the workspace box: how far from the beacon a target can be on an axis; 26 cm for the SO-101


def beacon_target_m(arm: Arm, beacon_m: Array, action: Array) -> Array:
    """The place (3,) m at an action (3,) from the beacon (3,) m, in units of SPAN."""
    return np.asarray(beacon_m + SPAN * float(np.linalg.norm(np.subtract(arm.box_high_m, arm.box_low_m))) * action)


def pose_near(arm: Arm, here: Array, target_m: Array, beacon_m: Array, approach_m: float, rng: np.random.Generator) -> Array:
    """The pose (n,) rad with the nose nearest to target_m (3,) whose straight path from `here` stays in the box, and after its first
    quarter no nearer to the beacon than approach_m; `here` if none is found."""
    far_m = max(float(np.linalg.norm(target_m - beacon_m)), approach_m)
    goals = target_m + SPREAD * far_m * np.vstack([np.zeros(3), rng.standard_normal((AROUND, 3))])
    goals = np.clip(goals, arm.box_low_m, arm.box_high_m)
    near, reached = arm.solve_ik_all(goals, np.repeat(here[None], len(goals), axis=0))
    poses = np.concatenate([near[reached], arm.random_poses(rng, ANYWHERE)])
    poses = poses[arm.path_is_free(here, poses) & (arm.clearance_m(here, poses, beacon_m) >= approach_m)]
    if not len(poses):
        return here
    return np.asarray(poses[int(np.argmin(np.linalg.norm(arm.nose(poses) - target_m, axis=1)))])
