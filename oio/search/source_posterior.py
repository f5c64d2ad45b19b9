"""Posterior of the source position given the signals of the moves: weighted positions (a cloud), refined by zooming in on their mass.

A signal z at nose p is normal about c = exp(l) c_1(p; s) with variance sigma^2 + c^2 (gamma^2 h^2 / eddies + misfit^2 + |w d ln c / ds|^2):
white noise, gas fluctuation (`oio.gas.fluctuation`), model discrepancy of the plume, and the width w of the cell that a position
represents.
So a coarse cloud does not claim more precision than its spacing, and zooming in does not lose the source. The strength is marginalised:
for each position the best ln strength l by Gauss-Newton, and a few about it.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from oio.core.records import Array
from oio.gas.range_law import EXPONENT, LAW, LN_STRENGTH, SOURCE, WIND, concentration
from oio.inference.sampling import halton
from oio.search.sniff_history import SniffHistory, believed_law
from oio.search.view import View

STEPS = 4  # Gauss-Newton iterations for ln strength
WIDE = 2.0  # strengths are tried up to so many standard deviations to either side
MARGIN = 3.0  # a zoom keeps so many standard deviations about the mean, and one cell


@dataclass(frozen=True, slots=True, eq=False)
class SourceParticles:
    """Weighted source positions (j, 3) m that represent cells of size cell_m (3,), ln strengths (j, a), and weights (j, a) of sum one."""

    places_m: Array
    cell_m: Array
    ln_strength: Array
    weight: Array

    def likeliest(self, mass: float) -> "SourceParticles":
        """Return the highest posterior density set: the fewest positions that hold `mass` of the weight."""
        w = np.sum(self.weight, axis=1)
        order = np.argsort(-w, kind="stable")
        kept = order[: int(np.searchsorted(np.cumsum(w[order]), mass)) + 1]
        return SourceParticles(self.places_m[kept], self.cell_m, self.ln_strength[kept], self.weight[kept] / np.sum(self.weight[kept]))


@dataclass(frozen=True, slots=True, eq=False)
class Likelihood:
    """Likelihood of the sniff history given source position and strength."""

    view: View
    seen: SniffHistory
    model_discrepancy: float
    strengths: int

    def unit(self, noses_m: Array, places_m: Array, cell_m: Array) -> tuple[Array, Array]:
        """Return mean (k, j) and relative standard deviation (k, j) at noses (k, 3) m of sources of unit strength at places (j, 3) m."""
        model, theta = self.view.model, believed_law(self.view)
        theta[SOURCE] = theta[LN_STRENGTH] = 0.0
        offsets_m = (noses_m[:, None, :] - places_m[None, :, :]).reshape(-1, 3)
        c, grad, r, rarity = concentration(offsets_m, theta[:LAW], model.law.r_ref_m, model.law.radius_m)
        field, fl = model.law.field(c, rarity, r, np.zeros_like(r), float(theta[EXPONENT]), grad[:, WIND]), model.fluctuation
        eddies = np.maximum(self.view.dwell_s * fl.rate(field), 1.0)
        within_cell = grad[:, SOURCE] ** 2 @ cell_m**2 / 12.0
        relative = np.sqrt((fl.gamma * fl.height(field)) ** 2 / eddies + self.model_discrepancy**2 + within_cell)
        shape = len(noses_m), len(places_m)
        return c.reshape(shape), relative.reshape(shape)

    def ln(self, places_m: Array, cell_m: Array) -> tuple[Array, Array]:
        """Return ln strengths (j, a) tried at places (j, 3) m, and the ln posterior (j, a) of both, up to a constant."""
        model, z = self.view.model, self.seen.ppm[:, None]
        unit, relative = self.unit(self.seen.p_m, places_m, cell_m)
        prior_ln, prior_u = model.law.strength(max(float(np.max(z)), model.sigma_ppm)), model.law.ln_strength_u
        l = np.full(len(places_m), prior_ln)
        spread = np.full(len(places_m), prior_u)
        for _ in range(STEPS):
            c = np.exp(l) * unit
            weight = c / (model.sigma_ppm**2 + (relative * np.maximum(c, z)) ** 2)
            spread = 1.0 / np.sqrt(np.sum(weight * c, axis=0) + prior_u**-2)
            l = l + np.clip(spread**2 * (np.sum(weight * (z - c), axis=0) - (l - prior_ln) / prior_u**2), -1.0, 1.0)
        tried = l[:, None] + spread[:, None] * np.linspace(-WIDE, WIDE, self.strengths + 2)[1:-1]
        c = np.exp(tried) * unit[:, :, None]  # (m, j, a)
        variance = model.sigma_ppm**2 + (relative[:, :, None] * c) ** 2
        ln_likelihood = -0.5 * np.sum((z[:, :, None] - c) ** 2 / variance + np.log(variance), axis=0)
        return tried, ln_likelihood - 0.5 * ((tried - prior_ln) / prior_u) ** 2 + np.log(spread)[:, None]

    def expected(self, cloud: SourceParticles, noses_m: Array) -> tuple[Array, Array]:
        """Return mean and standard deviation (k, j, a) ppm of a signal at noses (k, 3) m, for every position and strength of the cloud."""
        unit, relative = self.unit(noses_m, cloud.places_m, cloud.cell_m)
        mean = np.exp(cloud.ln_strength) * unit[:, :, None]
        return mean, np.sqrt(self.view.model.sigma_ppm**2 + (relative[:, :, None] * mean) ** 2)


def posterior(likelihood: Likelihood, count: int, zooms: int) -> SourceParticles:
    """Return a cloud of `count` positions with posterior weights; the prior is uniform in the nose's workspace box."""
    low, high = np.array(likelihood.view.arm.box_low_m), np.array(likelihood.view.arm.box_high_m)
    cloud = _weighted_cloud(likelihood, low, high, count)
    for _ in range(zooms):
        w = np.sum(cloud.weight, axis=1)
        mean = w @ cloud.places_m
        half_width = MARGIN * np.sqrt(w @ (cloud.places_m - mean) ** 2) + cloud.cell_m
        low, high = np.maximum(low, mean - half_width), np.minimum(high, mean + half_width)
        cloud = _weighted_cloud(likelihood, low, high, count)
    return cloud


def _weighted_cloud(likelihood: Likelihood, low: Array, high: Array, count: int) -> SourceParticles:
    """Cloud of `count` positions in a box, with posterior weights."""
    places, cell = low + _halton_points(count) * (high - low), (high - low) / np.cbrt(count)
    tried, ln = likelihood.ln(places, cell)
    weight = np.exp(ln - np.max(ln))
    return SourceParticles(places, cell, tried, weight / np.sum(weight))


@cache
def _halton_points(count: int) -> Array:
    """Halton points, cached: they take longer than the rest."""
    points = halton(count)
    points.flags.writeable = False
    return points
