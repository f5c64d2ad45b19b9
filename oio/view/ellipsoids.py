"""Bodies of a belief as the Rerun viewer draws them: range spheres, and 95 % ellipsoids of hypotheses."""

from collections.abc import Sequence

import numpy as np

from oio.core.quaternions import quaternion
from oio.core.records import Array
from oio.log import BeliefScene
from oio.log.scene import CHI2_95

Bodies = tuple[Array, Array, Array, list[int]]  # centres (k, 3) m, half axes (k, 3) m, quaternions (k, 4), and how many are of each scene


def range_spheres(scenes: Sequence[BeliefScene]) -> Bodies:
    """Return the range spheres of several scenes; one that is not finite cannot be drawn and is left out."""
    drawn = [np.isfinite(scene.centres_m).all(axis=1) & np.isfinite(scene.radii_m) for scene in scenes]
    centres = np.concatenate([scene.centres_m[kept] for scene, kept in zip(scenes, drawn, strict=True)])
    radii_m = np.concatenate([scene.radii_m[kept] for scene, kept in zip(scenes, drawn, strict=True)])
    unturned = np.tile([0.0, 0.0, 0.0, 1.0], (len(radii_m), 1))
    return centres, radii_m[:, None] * np.ones(3), unturned, [int(kept.sum()) for kept in drawn]


def hypotheses(scenes: Sequence[BeliefScene]) -> Bodies:
    """Return the 95 % ellipsoids of the hypotheses of several scenes; one that is not finite cannot be drawn and is left out."""
    drawn = [[(mean, cov) for mean, cov in scene.hypotheses if np.isfinite(mean).all() and np.isfinite(cov).all()] for scene in scenes]
    bodies = [body for of_scene in drawn for body in of_scene]
    centres = np.array([mean for mean, _ in bodies]).reshape(-1, 3)
    variances, axes = np.linalg.eigh(np.array([cov for _, cov in bodies]).reshape(-1, 3, 3))
    axes[:, :, 0] *= np.copysign(1.0, np.linalg.det(axes))[:, None]  # eigenvectors may be a mirror, a rotation may not
    turns = np.array([quaternion(turn) for turn in axes]).reshape(-1, 4)
    return centres, np.sqrt(CHI2_95 * np.maximum(variances, 0.0)), turns, [len(of_scene) for of_scene in drawn]
