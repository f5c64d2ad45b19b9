"""Infotaxis: the next sniff has the greatest expected entropy reduction of the source position per second.

Vergassola, Villermaux, Shraiman (2007), Nature 445:406. There, hits are counted and the posterior is a grid map; here, a sniff has a
signal, and the posterior is a cloud of weighted positions (`oio.search.source_posterior`). The signal is quantised to levels that are
equally probable under the cloud; the expected entropy reduction is the mutual information of level and position,

I = H(level) - sum_j w_j H(level | place j) >= 0.

Their term for finding the source by reaching it is left out: it does not end the search here. Candidates are random poses, and poses
about positions drawn from the cloud. Per second beats per move: after 30 s of the model's own gas, 5 DoF, the cloud's mean is 7 mm off,
not 38 (medians of 40 runs).
"""

from typing import Annotated

import numpy as np
from scipy.special import ndtr, ndtri, xlogy

from oio.core.records import Array
from oio.core.settings import Within, settings
from oio.search.sniff_history import joint_offsets, last_goal, sniff_history
from oio.search.source_posterior import Likelihood, SourceParticles, posterior
from oio.search.step_planning import is_allowed, nearest_poses, random_step
from oio.search.view import View

MASS = 0.999  # share of the posterior weight that is evaluated
DRAWN = 10  # poses drawn per random candidate: most have the nose outside its workspace box


@settings
class Infotaxis:
    """Infotaxis strategy: resolution of the posterior and number of candidates."""

    places: Annotated[int, Within(8, 100_000)]  # source positions in the cloud
    refinements: Annotated[int, Within(0, 20)]  # refinements of the cloud, each to where the last one has its mass
    strengths: Annotated[int, Within(1, 100)]  # emission strengths about the best one of every position
    model_discrepancy: Annotated[float, Within(0, 10)]  # of a real plume from the range law (ln C)
    levels: Annotated[int, Within(2, 100)]  # of the quantised signal
    random_candidates: Annotated[int, Within(1, 10_000)]  # random candidates
    local_candidates: Annotated[int, Within(0, 10_000)]  # candidates about likely source positions
    distances_m: Annotated[tuple[float, ...], Within(1e-3, 10)]  # of the latter from these

    def propose(self, view: View, rng: np.random.Generator) -> Array:
        """Return the next joint goal (n,) rad."""
        history = sniff_history(view)
        if len(history.ppm) == 0:
            return random_step(view, rng)
        likelihood = Likelihood(view, history, self.model_discrepancy, self.strengths)
        cloud = posterior(likelihood, self.places, self.refinements)
        q = self._candidates(view, cloud, rng)
        cost_s = np.array([view.arm.duration_s(last_goal(view), pose) + view.dwell_s for pose in q])
        gain = expected_information(likelihood, cloud, view.arm.nose(q - joint_offsets(view)), self.levels)
        return np.asarray(q[int(np.argmax(gain / cost_s))])

    def _candidates(self, view: View, cloud: SourceParticles, rng: np.random.Generator) -> Array:
        """Allowed poses (k, n), at least one."""
        places = cloud.places_m[rng.choice(len(cloud.places_m), self.local_candidates, p=np.sum(cloud.weight, axis=1))]
        offset = rng.standard_normal((self.local_candidates, 3))
        offset *= rng.choice(self.distances_m, (self.local_candidates, 1)) / np.linalg.norm(offset, axis=1)[:, None]
        drawn = rng.uniform(view.arm.low_rad, view.arm.high_rad, (DRAWN * self.random_candidates, view.arm.dof))
        inside = np.all((view.arm.nose(drawn) >= view.arm.box_low_m) & (view.arm.nose(drawn) <= view.arm.box_high_m), axis=1)
        poses = [*nearest_poses(view, places + offset), *drawn[inside][: self.random_candidates]]
        return np.array([q for q in poses if is_allowed(view, q)] or [random_step(view, rng)])


def expected_information(likelihood: Likelihood, cloud: SourceParticles, noses_m: Array, levels: int) -> Array:
    """Return the expected entropy reduction (k,) nat of the source position by sniffs at noses (k, 3) m (mutual information)."""
    likely = cloud.likeliest(MASS)
    mean, sd = likelihood.expected(likely, noses_m)  # (k, j, a) ppm
    cdf = ndtr((_edges(likelihood, likely.weight, mean, sd, levels)[..., None, None] - mean[:, None]) / sd[:, None])  # (k, l - 1, j, a)
    w = np.sum(likely.weight, axis=1)
    cdf = np.einsum("klja,ja->klj", cdf, likely.weight / w[:, None])
    probability = np.maximum(np.diff(cdf, axis=1, prepend=0.0, append=1.0), 0.0)  # of a level (k, l, j) given a source at j
    marginal = probability @ w
    return np.asarray(np.sum(xlogy(probability, probability), axis=1) @ w - np.sum(xlogy(marginal, marginal), axis=1))


def _edges(likelihood: Likelihood, weight: Array, mean: Array, sd: Array, levels: int) -> Array:
    """Level boundaries (k, l - 1) ppm: as if the signal plus its white noise were log-normal, all levels are equally probable."""
    floor = likelihood.view.model.sigma_ppm
    ln = np.log(mean + floor)
    mean_ln = np.einsum("kja,ja->k", ln, weight)
    variance_ln = np.einsum("kja,ja->k", (ln - mean_ln[:, None, None]) ** 2 + (sd / (mean + floor)) ** 2, weight)
    return np.asarray(np.exp(mean_ln[:, None] + np.sqrt(variance_ln)[:, None] * ndtri(np.arange(1, levels) / levels)) - floor)
