"""How a strategy goes a step: the pose whose nose comes nearest a wanted place and may be gone to.

A place is wanted in space, but the arm has joints: with one the nose stays on an arc, with two on a surface.
"""

import numpy as np

from oio.core.records import Array
from oio.gas.range_law import SOURCE
from oio.search.sniff_history import believed_law, joint_offsets, last_goal
from oio.search.view import View

ITERATIONS = 16  # of damped least squares; each may turn a joint by a tenth of its range
DAMPING_M2 = 1e-4
SIDESTEPS = 15  # tried when the straight step may not be gone
CLEAR = 1.05  # places wanted too near the source are moved this many near_m from it
TRIES = 64  # random poses


def box_diagonal_m(view: View) -> float:
    """Of the nose's box: what steps are measured in, so that they suit an arm on a table and a gantry in a room."""
    return float(np.linalg.norm(np.subtract(view.arm.box_high_m, view.arm.box_low_m)))


def is_allowed(view: View, q: Array) -> bool:
    """Whether the arm may go to q (n,) from where it is: within limits and box all the way, and clear of the believed source."""
    start = last_goal(view)
    if not (view.arm.inside(q) and view.arm.free(start, q)):
        return False
    return view.belief is None or _clearance_m(view, q) >= view.standoff_m


def _clearance_m(view: View, q: Array) -> float:
    o = joint_offsets(view)
    return float(view.arm.clearance_m(last_goal(view) - o, q - o, believed_law(view)[SOURCE]))


def tangent_directions(view: View, q: Array) -> Array:
    """Orthonormal directions (3, r) that the nose can be moved in at q (n,)."""
    _, jac = view.arm.nose_jacobian(q - joint_offsets(view))
    left, size, _ = np.linalg.svd(jac, full_matrices=False)
    return np.asarray(left[:, size > 1e-3 * size[0]])


def nearest_poses(view: View, places_m: Array) -> Array:
    """Joints (k, n) within limits that bring the nose nearest to places (k, 3) m, by damped least squares from where the arm is."""
    arm, o = view.arm, joint_offsets(view)
    wanted, q = _clipped_to_box(view, places_m), np.repeat(last_goal(view)[None], len(places_m), axis=0)
    most = 0.1 * (arm.high_rad - arm.low_rad)
    for _ in range(ITERATIONS):
        p, jac = arm.nose_jacobian(q - o)
        part = np.linalg.solve(jac @ jac.transpose(0, 2, 1) + DAMPING_M2 * np.eye(3), (wanted - p)[:, :, None])
        step = (jac.transpose(0, 2, 1) @ part)[:, :, 0]
        q = np.clip(q + np.clip(step, -most, most), arm.low_rad, arm.high_rad)
    return np.asarray(q)


def _clipped_to_box(view: View, places_m: Array) -> Array:
    """The same places, a hundredth of the box within it: what is reached may miss a little."""
    low, high = np.array(view.arm.box_low_m), np.array(view.arm.box_high_m)
    return np.clip(places_m, low + 0.01 * (high - low), high - 0.01 * (high - low))


def step_toward(view: View, place_m: Array, rng: np.random.Generator) -> Array:
    """The pose (n,) that goes at least a third of the way to place_m (3,): straight, else half, else aside, else anywhere."""
    start, o = last_goal(view), joint_offsets(view)
    p = view.arm.nose(start - o)
    wanted = _clipped_to_box(view, _clear_of_source(view, place_m))
    way = float(np.linalg.norm(wanted - p))
    aside = rng.standard_normal((SIDESTEPS, 3))
    aside *= 0.7 * way / np.linalg.norm(aside, axis=1)[:, None]
    q = nearest_poses(view, np.vstack([wanted, wanted + aside[np.argsort(np.linalg.norm(wanted + aside - p, axis=1))]]))
    poses = np.vstack([q[:1], 0.5 * (start + q[:1]), q[1:]])
    gone = np.linalg.norm(view.arm.nose(poses - o) - p, axis=1)
    chosen = next((pose for pose, far in zip(poses, gone, strict=True) if far > way / 3.0 and is_allowed(view, pose)), None)
    return random_step(view, rng) if chosen is None else np.asarray(chosen)


def _clear_of_source(view: View, place_m: Array) -> Array:
    """The place itself, or moved away from the believed source."""
    if view.belief is None:
        return place_m
    away = place_m - believed_law(view)[SOURCE]
    far = max(float(np.linalg.norm(away)), 1e-9)
    return place_m if far >= CLEAR * view.standoff_m else believed_law(view)[SOURCE] + CLEAR * view.standoff_m / far * away


def random_step(view: View, rng: np.random.Generator) -> Array:
    """A random pose (n,) that is allowed; if there is none, the one farthest from the believed source, or where the arm is."""
    start = last_goal(view)
    free = [start]
    for _ in range(TRIES):
        q = view.arm.random_pose(rng)
        if is_allowed(view, q):
            return q
        if view.arm.free(start, q):
            free.append(q)
    return free[0] if view.belief is None else max(free, key=lambda q: _clearance_m(view, q))
