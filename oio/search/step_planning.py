"""Step planning: the allowed pose whose nose comes nearest to a target position.

A target is a point in space, but the arm may lack joints: with one the nose stays on an arc, with two on a surface.
"""

import numpy as np

from oio.core.records import Array
from oio.gas.range_law import SOURCE
from oio.search.sniff_history import believed_law, joint_offsets, last_goal
from oio.search.view import View

ITERATIONS = 16  # of damped least squares; each moves a joint by at most a tenth of its range
DAMPING_M2 = 1e-4
SIDESTEPS = 15  # tried when the straight step is not allowed
CLEAR = 1.05  # targets too near the source are moved to so many stand-off distances from it
TRIES = 64  # random poses drawn


def box_diagonal_m(view: View) -> float:
    """Return the diagonal of the nose's workspace box [m], the unit of steps, so that they suit a table-top arm and a room gantry."""
    return float(np.linalg.norm(np.subtract(view.arm.box_high_m, view.arm.box_low_m)))


def is_allowed(view: View, q: Array) -> bool:
    """Return whether the arm may go to q (n,): joint limits and workspace box along the path, and stand-off from the believed source."""
    start = last_goal(view)
    if not (view.arm.is_allowed(q) and view.arm.path_is_free(start, q)):
        return False
    return view.belief is None or _clearance_m(view, q) >= view.standoff_m


def _clearance_m(view: View, q: Array) -> float:
    """Smallest distance of the nose from the believed source along the path to q [m]."""
    o = joint_offsets(view)
    return float(view.arm.clearance_m(last_goal(view) - o, q - o, believed_law(view)[SOURCE]))


def tangent_directions(view: View, q: Array) -> Array:
    """Return orthonormal directions (3, r) in which the nose can move at q (n,)."""
    _, jac = view.arm.nose_jacobian(q - joint_offsets(view))
    axes, singular_values, _ = np.linalg.svd(jac, full_matrices=False)
    return np.asarray(axes[:, singular_values > 1e-3 * singular_values[0]])


def nearest_poses(view: View, places_m: Array) -> Array:
    """Inverse kinematics by damped least squares from the last goal: joints (k, n) within limits, noses nearest to places (k, 3) m."""
    arm, o = view.arm, joint_offsets(view)
    target, q = _clipped_to_box(view, places_m), np.repeat(last_goal(view)[None], len(places_m), axis=0)
    max_step = 0.1 * (arm.high_rad - arm.low_rad)
    for _ in range(ITERATIONS):
        p, jac = arm.nose_jacobian(q - o)
        damped = np.linalg.solve(jac @ jac.transpose(0, 2, 1) + DAMPING_M2 * np.eye(3), (target - p)[:, :, None])
        step = (jac.transpose(0, 2, 1) @ damped)[:, :, 0]
        q = np.clip(q + np.clip(step, -max_step, max_step), arm.low_rad, arm.high_rad)
    return np.asarray(q)


def _clipped_to_box(view: View, places_m: Array) -> Array:
    """Positions clipped to the workspace box less 1 % on every side: the pose found may miss its target a little."""
    low, high = np.array(view.arm.box_low_m), np.array(view.arm.box_high_m)
    return np.clip(places_m, low + 0.01 * (high - low), high - 0.01 * (high - low))


def step_toward(view: View, place_m: Array, rng: np.random.Generator) -> Array:
    """Return the pose (n,) that goes at least a third of the way to place_m (3,): straight, else half, else sideways, else random."""
    start, o = last_goal(view), joint_offsets(view)
    p = view.arm.nose(start - o)
    target = _clipped_to_box(view, _clear_of_source(view, place_m))
    distance_m = float(np.linalg.norm(target - p))
    sidesteps = rng.standard_normal((SIDESTEPS, 3))
    sidesteps *= 0.7 * distance_m / np.linalg.norm(sidesteps, axis=1)[:, None]
    q = nearest_poses(view, np.vstack([target, target + sidesteps[np.argsort(np.linalg.norm(target + sidesteps - p, axis=1))]]))
    poses = np.vstack([q[:1], 0.5 * (start + q[:1]), q[1:]])
    moved_m = np.linalg.norm(view.arm.nose(poses - o) - p, axis=1)
    chosen = next((pose for pose, moved in zip(poses, moved_m, strict=True) if moved > distance_m / 3.0 and is_allowed(view, pose)), None)
    return random_step(view, rng) if chosen is None else np.asarray(chosen)


def _clear_of_source(view: View, place_m: Array) -> Array:
    """The position itself, or moved out to the stand-off distance from the believed source."""
    if view.belief is None:
        return place_m
    offset = place_m - believed_law(view)[SOURCE]
    distance_m = max(float(np.linalg.norm(offset)), 1e-9)
    return place_m if distance_m >= CLEAR * view.standoff_m else believed_law(view)[SOURCE] + CLEAR * view.standoff_m / distance_m * offset


def random_step(view: View, rng: np.random.Generator) -> Array:
    """Return a random allowed pose (n,); if none is found, the one farthest from the believed source, or the last goal."""
    start = last_goal(view)
    fallback = [start]
    for _ in range(TRIES):
        q = view.arm.random_pose(rng)
        if is_allowed(view, q):
            return q
        if view.arm.path_is_free(start, q):
            fallback.append(q)
    return fallback[0] if view.belief is None else max(fallback, key=lambda q: _clearance_m(view, q))
