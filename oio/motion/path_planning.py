"""Ways between poses on which the nose stays in its box: straight in joint space where that will do, else over poses in between.

A straight line in joint space bends in space: between two allowed poses the nose may dip into the table. Where it would, the way leads over
one or two poses of a small roadmap (Kavraki et al. 1996, IEEE Trans. Robotics and Automation 12:566), always the same ones.
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

TOLERANCE_M = 0.0005  # so far the nose may bow out of its box when a move is planned
CHECK_STEP_RAD = 0.02  # between places that are looked at, all joints together: an arm of 0.6 m bows 0.03 mm in between
MIN_CHECKS = 64  # at least: the fastest of so many spans is within 0.1 % of the peak speed
COARSE_CHECKS = 24  # places of a way that is only thought of
ROADMAP_POSES = 60  # poses anywhere in the box
MAX_CANDIDATES = 100  # ways over the roadmap, the shortest first, that are looked at closely
MIN_SEGMENT_S = 0.1  # that a leg lasts


class Segment(NamedTuple):
    """A minimum-jerk move, straight in joint space."""

    start: Array  # (n,) rad
    turn: Array  # (n,) rad
    over_s: float
    rush_m: float  # peak speed of the nose times over_s

    def joints_at(self, t_s: float) -> Array:
        """The joints (n,) after so long."""
        return np.asarray(self.start + minimum_jerk(t_s / self.over_s) * self.turn)


JointPath = tuple[Segment, ...]


def joints_at(way: JointPath, t_s: float) -> Array:
    """The joints (n,) so long after its beginning."""
    for leg in way[:-1]:
        if t_s < leg.over_s:
            return leg.joints_at(t_s)
        t_s -= leg.over_s
    return way[-1].joints_at(t_s)


def duration_s(way: JointPath) -> float:
    """Seconds from its beginning to its end."""
    return float(sum(leg.over_s for leg in way))


def plan(arm: Arm, q_from: Array, q_to: Array, margin_m: float = TOLERANCE_M, joints: int | None = None) -> JointPath:
    """The way from q_from (n,) to q_to (n,) on which the nose leaves its box by margin_m at most and keeps to `arm.nose_limit_m_s`.

    Straight if that will do. Poses in between turn the first `joints` joints alone where the others are at home. Raises BadInput if there
    is no way.
    """
    leg, box_violation_m = _straight(arm, q_from, q_to)
    if box_violation_m <= margin_m:
        return (leg,)
    part = joints if joints is not None and _others_are_home(arm, q_from, q_to, joints) else arm.dof
    chain = _via_poses(arm if part == arm.dof else replace(arm, dof=part), q_from[:part], q_to[:part], margin_m, box_violation_m)
    whole = [q_from, *(np.concatenate([pose, q_to[part:]]) for pose in chain), q_to]
    return tuple(_straight(arm, a, b)[0] for a, b in itertools.pairwise(whole))


def _others_are_home(arm: Arm, q_from: Array, q_to: Array, joints: int) -> bool:
    return bool(np.allclose([q_from[joints:], q_to[joints:]], arm.home[joints:], atol=1e-6))


def _straight(arm: Arm, q_from: Array, q_to: Array) -> tuple[Segment, float]:
    """The straight way, and how far [m] the nose gets out of its box on it (negative: how far it stays inside)."""
    turn = np.asarray(q_to - q_from)
    count = max(MIN_CHECKS, int(np.ceil(PEAK_OVER_MEAN * np.sum(np.abs(turn)) / CHECK_STEP_RAD)))
    share = np.array([minimum_jerk(i / count) for i in range(count + 1)])
    nose = arm.nose(q_from + share[:, None] * turn)
    rush_m = count * float(np.max(np.linalg.norm(np.diff(nose, axis=0), axis=1)))
    over_s = max(float(arm.duration_s(q_from, q_to)), MIN_SEGMENT_S, rush_m / arm.nose_limit_m_s)
    return Segment(q_from, turn, over_s, rush_m), box_violation_m(arm, nose)


def box_violation_m(arm: Arm, nose: Array) -> float:
    """How far places (k, 3) m are out of the box, along the axis where it is most."""
    return float(np.max(np.maximum(np.array(arm.box_low_m) - nose, nose - np.array(arm.box_high_m))))


def _via_poses(arm: Arm, q_from: Array, q_to: Array, margin_m: float, far_m: float) -> list[Array]:
    """Poses (n,), one or two, over which to go."""
    for chain in itertools.islice(_via_candidates(arm, q_from, q_to, margin_m), MAX_CANDIDATES):
        if all(_straight(arm, a, b)[1] <= margin_m for a, b in itertools.pairwise([q_from, *chain, q_to])):
            return chain
    raise BadInput(
        f"no way was found from {np.round(q_from, 3).tolist()} to {np.round(q_to, 3).tolist()} rad on which the nose stays between "
        f"arm.box_low_m={list(arm.box_low_m)} and arm.box_high_m={list(arm.box_high_m)}; on the straight one it gets {1e3 * far_m:.0f} mm "
        f"out. Ask for a pose that bends as the arm bends now, let more joints move (dof={arm.ladder[-1]}), or widen the box."
    )


def _via_candidates(arm: Arm, q_from: Array, q_to: Array, margin_m: float) -> Iterator[list[Array]]:
    """Single poses of the roadmap, then pairs, those on the shortest ways first."""
    poses = _roadmap(arm, q_from, q_to)
    first, last = _coarse_duration_s(arm, q_from, poses, margin_m), _coarse_duration_s(arm, poses, q_to, margin_m)
    yield from ([poses[i]] for (i,) in _shortest(first + last))
    between = _coarse_duration_s(arm, poses[:, None], poses[None, :], margin_m)
    yield from ([poses[i], poses[j]] for i, j in _shortest(first[:, None] + between + last[None, :]))


def _shortest(total_s: Array) -> Iterator[tuple[int, ...]]:
    """Indices of the finite ones, in order."""
    for flat in np.argsort(total_s, axis=None)[: np.count_nonzero(np.isfinite(total_s))]:
        yield tuple(int(i) for i in np.unravel_index(flat, total_s.shape))


def _roadmap(arm: Arm, q_from: Array, q_to: Array) -> Array:
    """Poses (k, n) in the box: near the straight way where they can be, home, and anywhere."""
    low, high = np.array(arm.box_low_m), np.array(arm.box_high_m)
    inset = 0.05 * (high - low)
    near = q_from + np.array([[0.25], [0.5], [0.75]]) * (q_to - q_from)
    reached, there = arm.reach_all(np.clip(arm.nose(near), low + inset, high - inset), near)
    return np.vstack([reached[there], arm.home, arm.random_poses(np.random.default_rng(0), ROADMAP_POSES)])


def _coarse_duration_s(arm: Arm, q_from: Array, q_to: Array, margin_m: float) -> Array:
    """Seconds (...) of straight ways between poses (..., n), infinite where the nose leaves its box."""
    share = np.linspace(0.0, 1.0, COARSE_CHECKS).reshape(-1, *(1,) * max(np.ndim(q_from), np.ndim(q_to)))
    nose = arm.nose(np.asarray(q_from + share * (q_to - q_from)))
    low, high = np.array(arm.box_low_m) - margin_m, np.array(arm.box_high_m) + margin_m
    return np.where(np.all((nose >= low) & (nose <= high), axis=(0, -1)), arm.duration_s(q_from, q_to), np.inf)
