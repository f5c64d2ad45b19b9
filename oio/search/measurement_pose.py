"""Where the nose measures a source whose place is known: at a given distance, in a random direction."""

from collections.abc import Callable

import numpy as np

from oio.core.errors import NotObservable
from oio.core.records import Array
from oio.kinematics.arm import Arm

TRIES = 200  # directions, with straight paths and again with planned ones


def measurement_pose(
    arm: Arm, here: Array, place_m: Array, distance_m: float, approach_m: float, has_path: Callable[[Array], bool], rng: np.random.Generator
) -> Array:
    """A pose (n,) rad with the nose distance_m from place_m (3,); any pose for arms of one or two joints, which cannot choose it.

    On its path from `here` (n,) the nose comes no nearer than approach_m, or 0.9 of the distance. Straight paths in joint space are
    preferred; where there is none, one that `has_path` finds around the edges of the box, also to poses that inverse kinematics cannot
    reach from `here`, but from the rest pose. Raises NotObservable if there is no such pose: a measurement elsewhere would pass for one at
    this distance.
    """
    for is_free, begin in ((lambda q: bool(arm.path_is_free(here, q)), here), (has_path, here), (has_path, arm.home)):
        for _ in range(TRIES):
            pose = _candidate(arm, begin, place_m, distance_m, rng)
            if pose is not None and is_free(pose) and arm.clearance_m(here, pose, place_m) >= min(approach_m, 0.9 * distance_m):
                return pose
    raise NotObservable(
        f"no pose was found with the nose {distance_m:g} m from the source at {np.round(place_m, 3).tolist()}, inside its box all the way. "
        f"Move the source (beacon.position), leave this distance out (distances_m), or widen arm.box_low_m and arm.box_high_m."
    )


def _candidate(arm: Arm, begin: Array, place_m: Array, distance_m: float, rng: np.random.Generator) -> Array | None:
    direction = rng.standard_normal(3)  # drawn for every arm, so that the stream of random numbers does not depend on its joints
    if arm.dof < 3:
        return arm.random_pose(rng)
    return arm.solve_ik(place_m + distance_m * direction / np.linalg.norm(direction), begin)
