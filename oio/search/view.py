"""What a strategy sees, and the pose that explores best when nothing is believed yet."""

from dataclasses import dataclass

import numpy as np

from oio.arm import Arm
from oio.batch import Fit
from oio.model import Model
from oio.records import Array, Belief


@dataclass(frozen=True)
class Move:
    """A finished move: the goal (n,) rad, which fraction of its readings were bouts, the mean signal at its end [ppm], and the
    highest one on the way above what was left of earlier sniffs, in standard deviations of a reading."""

    q: Array
    bouts: float
    ppm: float
    peak: float = 0.0


@dataclass(frozen=True)
class View:
    """The search so far."""

    arm: Arm
    model: Model
    belief: Belief | None  # None until the first belief map
    hypotheses: tuple[Fit, ...]
    moves: tuple[Move, ...]
    dwell_s: float
    near_m: float  # the nose keeps this far from where the source is believed
    law: Array | None = None  # calibrated mean (LAW,) of the range law, for before the first belief; None: the nominal law


def spread_out(view: View, rng: np.random.Generator, tries: int = 64) -> Array:
    """Of `tries` random poses the one whose nose gets farthest from all sniffed places for the time it takes.

    A maximin design (Johnson, Moore, Ylvisaker 1990) that pays for its travel.
    """
    here = view.moves[-1].q if view.moves else view.arm.home
    poses = np.array([view.arm.random_pose(rng) for _ in range(tries)])
    free = view.arm.free(here, poses)
    candidates = poses[free] if np.any(free) else poses
    seen = view.arm.nose(np.array([view.arm.home, *(move.q for move in view.moves)]))
    distance = np.linalg.norm(view.arm.nose(candidates)[:, None, :] - seen[None, :, :], axis=2).min(axis=1)
    cost_s = view.arm.duration_s(here, candidates) + view.dwell_s
    return np.asarray(candidates[int(np.argmax(distance / cost_s))])
