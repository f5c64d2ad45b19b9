"""Verification before a declaration: sniffs where another hypothesis has the source, because there a wrong answer shows.

While several hypotheses are left and the best is nearly narrow enough to be declared, the nose goes to each of the others that it has not
sniffed yet. Of two hypotheses the sniff next to one has the greatest expected Bayes factor: there one foresees a peak, and the other none.
"""

from typing import Annotated

import numpy as np

from oio.core.records import Array
from oio.core.settings import Within, settings
from oio.search.d_optimal import path_is_clear, sd_m
from oio.search.view import View

CANDIDATES = 48  # poses about a hypothesis
VAGUE = 4  # times as many sniffs about a hypothesis that is not narrow, such as a second source that was hardly smelt yet


@settings
class Verification:
    """Settings of the verification; it costs `sniffs` moves for every other hypothesis, VAGUE times as many while that is vague."""

    below_sd_m: Annotated[float, Within(0, 100)]  # it begins when the root of the trace of the best hypothesis's covariance is below this
    radius_m: Annotated[float, Within(1e-3, 10)]  # a hypothesis was sniffed by a move that ended within this of it
    sniffs: Annotated[int, Within(0, 1000)]  # so many times
    distances_m: Annotated[tuple[float, ...], Within(1e-3, 10)]  # of these sniffs from the hypothesis

    def propose(self, view: View, rng: np.random.Generator) -> Array | None:
        """Return a pose (n,) rad next to a hypothesis that was not sniffed yet; None if there is no such hypothesis, or no such pose."""
        if view.belief is None or view.arm.dof < 3 or len(view.hypotheses) < 2 or sd_m(view) > self.below_sd_m:
            return None
        o = view.belief.mean[view.model.at["o"]]
        noses = view.arm.nose(np.array([move.q for move in view.moves]) - o) if view.moves else np.empty((0, 3))
        for other in view.hypotheses[1:]:
            sniffed = np.count_nonzero(np.linalg.norm(noses - other.source, axis=1) < self.radius_m)
            vague = np.sqrt(np.trace(other.source_cov)) > self.below_sd_m
            pose = self._pose_about(view, other.source, rng) if sniffed < self.sniffs * (VAGUE if vague else 1) else None
            if pose is not None:
                return pose
        return None

    def _pose_about(self, view: View, place_m: Array, rng: np.random.Generator) -> Array | None:
        direction = rng.standard_normal((CANDIDATES, 3))
        distance = rng.choice(self.distances_m, (CANDIDATES, 1))
        goals = place_m + distance * direction / np.linalg.norm(direction, axis=1, keepdims=True)
        q_now = view.moves[-1].q if view.moves else view.arm.home
        poses, reached = view.arm.solve_ik_all(goals, np.repeat(q_now[None], CANDIDATES, axis=0))
        poses = poses[reached]
        poses = poses[path_is_clear(view, poses)] if len(poses) else poses
        if not len(poses):
            return None
        return np.asarray(poses[int(np.argmin(view.arm.duration_s(q_now, poses)))])
