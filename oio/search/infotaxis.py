"""Infotaxis: the next sniff is the one that is expected to take most entropy from the place of the source, per second.

Vergassola, Villermaux, Shraiman (2007), Nature 445:406. There, hits are counted and the posterior is a map; here, a sniff has a signal,
and the posterior is a cloud of places (`oio.search.source_posterior`). What a sniff may say is cut into levels that the cloud expects
equally often;
the expected drop of entropy is the mutual information of level and place,

I = H(level) - sum_j w_j H(level | place j) >= 0.

Their term for finding the source by standing on it is left out: it ends no search here. Candidates are poses anywhere, and about places
drawn from the cloud. Per second beats per move: after 30 s of the model's own gas, 5 DoF, the cloud's mean is 7 mm off, not 38 (medians of
40 runs).
"""

import numpy as np
from scipy.special import ndtr, ndtri, xlogy

from oio.core.records import Array
from oio.core.settings import in_range, settings
from oio.search.sniff_history import joint_offsets, last_goal, sniff_history
from oio.search.source_posterior import Cloud, Likelihood, posterior
from oio.search.step_planning import is_allowed, nearest_poses, random_step
from oio.search.view import View

MASS = 0.999  # of the cloud that is looked at
DRAWN = 10  # poses for every candidate anywhere: most have their nose out of its box


@settings
class Infotaxis:
    """How finely the posterior is drawn, and how many candidates are weighed."""

    places: int  # of the cloud
    zooms: int  # the cloud is drawn anew so often, each time where the last one has its mass
    strengths: int  # about the best strength of every place
    model_discrepancy: float  # how far a real plume is from the law (ln C)
    levels: int  # of a signal
    anywhere: int  # candidates anywhere
    around: int  # candidates about likely places
    distances_m: tuple[float, ...]  # from these

    def check(self) -> None:
        """Refuse clouds of nothing, and levels that cannot tell anything."""
        in_range(self, places=(8, 100_000), zooms=(0, 20), strengths=(1, 100), model_discrepancy=(0.0, 10.0), levels=(2, 100))
        in_range(self, anywhere=(1, 10_000), around=(0, 10_000))

    def propose(self, view: View, rng: np.random.Generator) -> Array:
        """The next joint goal (n,) rad."""
        seen = sniff_history(view)
        if len(seen.ppm) == 0:
            return random_step(view, rng)
        likelihood = Likelihood(view, seen, self.model_discrepancy, self.strengths)
        cloud = posterior(likelihood, self.places, self.zooms)
        q = self._candidates(view, cloud, rng)
        cost_s = np.array([view.arm.duration_s(last_goal(view), pose) + view.dwell_s for pose in q])
        told = information(likelihood, cloud, view.arm.nose(q - joint_offsets(view)), self.levels)
        return np.asarray(q[int(np.argmax(told / cost_s))])

    def _candidates(self, view: View, cloud: Cloud, rng: np.random.Generator) -> Array:
        """Allowed poses (k, n), at least one."""
        places = cloud.places_m[rng.choice(len(cloud.places_m), self.around, p=np.sum(cloud.weight, axis=1))]
        way = rng.standard_normal((self.around, 3))
        way *= rng.choice(self.distances_m, (self.around, 1)) / np.linalg.norm(way, axis=1)[:, None]
        drawn = rng.uniform(view.arm.low_rad, view.arm.high_rad, (DRAWN * self.anywhere, view.arm.dof))
        inside = np.all((view.arm.nose(drawn) >= view.arm.box_low_m) & (view.arm.nose(drawn) <= view.arm.box_high_m), axis=1)
        poses = [*nearest_poses(view, places + way), *drawn[inside][: self.anywhere]]
        return np.array([q for q in poses if is_allowed(view, q)] or [random_step(view, rng)])


def information(likelihood: Likelihood, cloud: Cloud, noses_m: Array, levels: int) -> Array:
    """Expected drop of the entropy (k,) nat of the source's place by sniffs at noses (k, 3) m."""
    likely = cloud.likeliest(MASS)
    mean, sd = likelihood.expected(likely, noses_m)  # (k, j, a) ppm
    below = ndtr((_edges(likelihood, likely.weight, mean, sd, levels)[..., None, None] - mean[:, None]) / sd[:, None])  # (k, l - 1, j, a)
    w = np.sum(likely.weight, axis=1)
    below = np.einsum("klja,ja->klj", below, likely.weight / w[:, None])
    chance = np.maximum(np.diff(below, axis=1, prepend=0.0, append=1.0), 0.0)  # of a level (k, l, j) if the source is at j
    total = chance @ w
    return np.asarray(np.sum(xlogy(chance, chance), axis=1) @ w - np.sum(xlogy(total, total), axis=1))


def _edges(likelihood: Likelihood, weight: Array, mean: Array, sd: Array, levels: int) -> Array:
    """Between levels (k, l - 1) ppm: as if the signal plus its white noise were log-normal, all levels are equally likely."""
    floor = likelihood.view.model.sigma_ppm
    ln = np.log(mean + floor)
    middle = np.einsum("kja,ja->k", ln, weight)
    spread = np.einsum("kja,ja->k", (ln - middle[:, None, None]) ** 2 + (sd / (mean + floor)) ** 2, weight)
    return np.asarray(np.exp(middle[:, None] + np.sqrt(spread)[:, None] * ndtri(np.arange(1, levels) / levels)) - floor)
