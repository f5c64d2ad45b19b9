"""Path planning in joint space with the nose kept in its workspace box: a straight path where possible, else over via poses.

A straight line in joint space is a curve in Cartesian space: between two allowed poses the nose may dip into the table. Where it would, the
path leads over one or two poses of a small probabilistic roadmap (Kavraki et al. 1996, IEEE Trans. Robotics and Automation 12:566), drawn
from a fixed seed, so the same command always gives the same path.
"""

import itertools
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.kinematics.arm import Arm
from oio.kinematics.minimum_jerk import PEAK_OVER_MEAN, minimum_jerk

TOLERANCE_M = 0.0005  # by which a planned path may leave the box
CHECK_STEP_RAD = 0.02  # sum over the joints between two checked points: an arm of 0.6 m deviates 0.03 mm from a line in between
MIN_CHECKS = 64  # per segment: the fastest of so many spans is within 0.1 % of the peak speed
COARSE_CHECKS = 24  # per candidate segment of the roadmap
ROADMAP_POSES = 60  # random poses in the box
MAX_CANDIDATES = 100  # paths over the roadmap, the shortest first, that are checked finely
MIN_SEGMENT_S = 0.1  # duration


class Segment(NamedTuple):
    """A minimum-jerk move along a straight line in joint space."""

    start: Array  # (n,) rad
    delta: Array  # (n,) rad, from start to end
    over_s: float
    peak_m: float  # peak speed of the nose times over_s

    def joints_at(self, t_s: float) -> Array:
        """Joints (n,) rad at t_s after the start of the segment."""
        return np.asarray(self.start + minimum_jerk(t_s / self.over_s) * self.delta)


JointPath = tuple[Segment, ...]


def joints_at(path: JointPath, t_s: float) -> Array:
    """Joints (n,) rad on a path at t_s after its start."""
    for segment in path[:-1]:
        if t_s < segment.over_s:
            return segment.joints_at(t_s)
        t_s -= segment.over_s
    return path[-1].joints_at(t_s)


def duration_s(path: JointPath) -> float:
    """Duration of a path [s]."""
    return float(sum(segment.over_s for segment in path))


def plan(arm: Arm, q_from: Array, q_to: Array, margin_m: float = TOLERANCE_M, joints: int | None = None) -> JointPath:
    """Plan a path from q_from (n,) to q_to (n,) rad on which the nose leaves its box by at most margin_m and keeps to `arm.nose_limit_m_s`.

    Straight if possible. Via poses move the first `joints` joints alone where the others are at home (braked). Raises BadInput if no path
    is found.
    """
    segment, violation_m = _straight(arm, q_from, q_to)
    if violation_m <= margin_m:
        return (segment,)
    part = joints if joints is not None and _others_are_home(arm, q_from, q_to, joints) else arm.dof
    chain = _via_poses(arm if part == arm.dof else replace(arm, dof=part), q_from[:part], q_to[:part], margin_m, violation_m)
    whole = [q_from, *(np.concatenate([pose, q_to[part:]]) for pose in chain), q_to]
    return tuple(_straight(arm, a, b)[0] for a, b in itertools.pairwise(whole))


def _others_are_home(arm: Arm, q_from: Array, q_to: Array, joints: int) -> bool:
    return bool(np.allclose([q_from[joints:], q_to[joints:]], arm.home[joints:], atol=1e-6))


def _straight(arm: Arm, q_from: Array, q_to: Array) -> tuple[Segment, float]:
    """The straight segment, and by how much [m] the nose leaves its box on it (negative: by how much it stays inside)."""
    delta = np.asarray(q_to - q_from)
    count = max(MIN_CHECKS, int(np.ceil(PEAK_OVER_MEAN * np.sum(np.abs(delta)) / CHECK_STEP_RAD)))
    share = np.array([minimum_jerk(i / count) for i in range(count + 1)])
    nose = arm.nose(q_from + share[:, None] * delta)
    peak_m = count * float(np.max(np.linalg.norm(np.diff(nose, axis=0), axis=1)))
    over_s = max(float(arm.duration_s(q_from, q_to)), MIN_SEGMENT_S, peak_m / arm.nose_limit_m_s)
    return Segment(q_from, delta, over_s, peak_m), box_violation_m(arm, nose)


def box_violation_m(arm: Arm, nose: Array) -> float:
    """By how much points (k, 3) m are outside the nose's box, along the axis where it is most; negative inside."""
    return float(np.max(np.maximum(np.array(arm.box_low_m) - nose, nose - np.array(arm.box_high_m))))


def _via_poses(arm: Arm, q_from: Array, q_to: Array, margin_m: float, far_m: float) -> list[Array]:
    """One or two via poses (n,) rad. Raises BadInput if none gives a path."""
    for chain in itertools.islice(_via_candidates(arm, q_from, q_to, margin_m), MAX_CANDIDATES):
        if all(_straight(arm, a, b)[1] <= margin_m for a, b in itertools.pairwise([q_from, *chain, q_to])):
            return chain
    raise BadInput(
        f"no path was found from {np.round(q_from, 3).tolist()} to {np.round(q_to, 3).tolist()} rad on which the nose stays between "
        f"arm.box_low_m={list(arm.box_low_m)} and arm.box_high_m={list(arm.box_high_m)}; on the straight one it leaves that by "
        f"{1e3 * far_m:.0f} mm. Ask for a pose with the elbow bent as it is now, let more joints move (dof={arm.rungs[-1]}), or widen the "
        f"box."
    )


def _via_candidates(arm: Arm, q_from: Array, q_to: Array, margin_m: float) -> Iterator[list[Array]]:
    """Single poses of the roadmap, then pairs, in the order of their total duration."""
    poses = _roadmap(arm, q_from, q_to)
    first, last = _coarse_duration_s(arm, q_from, poses, margin_m), _coarse_duration_s(arm, poses, q_to, margin_m)
    yield from ([poses[i]] for (i,) in _shortest(first + last))
    between = _coarse_duration_s(arm, poses[:, None], poses[None, :], margin_m)
    yield from ([poses[i], poses[j]] for i, j in _shortest(first[:, None] + between + last[None, :]))


def _shortest(total_s: Array) -> Iterator[tuple[int, ...]]:
    """Indices of finite entries, in increasing order."""
    for flat in np.argsort(total_s, axis=None)[: np.count_nonzero(np.isfinite(total_s))]:
        yield tuple(int(i) for i in np.unravel_index(flat, total_s.shape))


def _roadmap(arm: Arm, q_from: Array, q_to: Array) -> Array:
    """Poses (k, n) rad in the box: near the straight path where they can be reached, home, and random ones."""
    low, high = np.array(arm.box_low_m), np.array(arm.box_high_m)
    inset = 0.05 * (high - low)
    near = q_from + np.array([[0.25], [0.5], [0.75]]) * (q_to - q_from)
    reached, there = arm.solve_ik_all(np.clip(arm.nose(near), low + inset, high - inset), near)
    return np.vstack([reached[there], arm.home, arm.random_poses(np.random.default_rng(0), ROADMAP_POSES)])


def _coarse_duration_s(arm: Arm, q_from: Array, q_to: Array, margin_m: float) -> Array:
    """Durations (...) s of straight segments between poses (..., n), infinite where the nose leaves its box."""
    share = np.linspace(0.0, 1.0, COARSE_CHECKS).reshape(-1, *(1,) * max(np.ndim(q_from), np.ndim(q_to)))
    nose = arm.nose(np.asarray(q_from + share * (q_to - q_from)))
    low, high = np.array(arm.box_low_m) - margin_m, np.array(arm.box_high_m) + margin_m
    return np.where(np.all((nose >= low) & (nose <= high), axis=(0, -1)), arm.duration_s(q_from, q_to), np.inf)
