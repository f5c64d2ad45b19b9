"""Where the source may be, given the signals of the moves: a cloud of places with weights, drawn anew where the last one has its mass.

A signal z at nose p is normal about c = exp(l) c_1(p; s) with variance sigma^2 + c^2 (gamma^2 h^2 / eddies + misfit^2 + |w d ln c / ds|^2):
white noise, gas that fluctuates (`oio.gas.fluctuation`), a plume that is not the law's, and the width w of the cell that the place
stands for.
So a coarse cloud does not pretend to know more than its spacing, and zooming in does not lose the source. The strength is marginalised:
for each place the best ln strength l by Gauss-Newton, and a few about it.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from oio.core.records import Array
from oio.gas.range_law import EXPONENT, LAW, LN_STRENGTH, SOURCE, concentration
from oio.inference.sampling import halton
from oio.search.sniff_history import SniffHistory, believed_law
from oio.search.view import View

STEPS = 4  # of Gauss-Newton, for ln strength
WIDE = 2.0  # standard deviations to either side that strengths are tried
MARGIN = 3.0  # standard deviations about the mean that a zoom keeps, and a cell


@dataclass(frozen=True, slots=True, eq=False)
class Cloud:
    """Places (j, 3) m that stand for cells of size cell_m (3,), ln strengths (j, a), and weights (j, a) that sum to one."""

    places_m: Array
    cell_m: Array
    ln_strength: Array
    weight: Array

    def likeliest(self, mass: float) -> "Cloud":
        """The fewest places that have so much of the weight."""
        w = np.sum(self.weight, axis=1)
        order = np.argsort(-w, kind="stable")
        kept = order[: int(np.searchsorted(np.cumsum(w[order]), mass)) + 1]
        return Cloud(self.places_m[kept], self.cell_m, self.ln_strength[kept], self.weight[kept] / np.sum(self.weight[kept]))


@dataclass(frozen=True, slots=True, eq=False)
class Likelihood:
    """Of what was sniffed, if the source were somewhere."""

    view: View
    seen: SniffHistory
    model_discrepancy: float
    strengths: int

    def unit(self, noses_m: Array, places_m: Array, cell_m: Array) -> tuple[Array, Array]:
        """At noses (k, 3) of sources of strength one at places (j, 3): mean (k, j) and its relative standard deviation (k, j)."""
        model, theta = self.view.model, believed_law(self.view)
        theta[SOURCE] = theta[LN_STRENGTH] = 0.0
        apart = (noses_m[:, None, :] - places_m[None, :, :]).reshape(-1, 3)
        c, grad, r, rarity = concentration(apart, theta[:LAW], model.law.r_ref_m, model.law.radius_m)
        field, fl = model.law.field(c, rarity, r, np.zeros_like(r), float(theta[EXPONENT])), model.fluctuation
        eddies = np.maximum(self.view.dwell_s * fl.rate(field), 1.0)
        within = grad[:, SOURCE] ** 2 @ cell_m**2 / 12.0
        relative = np.sqrt((fl.gamma * fl.height(field)) ** 2 / eddies + self.model_discrepancy**2 + within)
        shape = len(noses_m), len(places_m)
        return c.reshape(shape), relative.reshape(shape)

    def ln(self, places_m: Array, cell_m: Array) -> tuple[Array, Array]:
        """ln strengths (j, a) tried at places (j, 3) m, and ln posterior (j, a) of both, up to a constant."""
        model, z = self.view.model, self.seen.ppm[:, None]
        unit, relative = self.unit(self.seen.p_m, places_m, cell_m)
        about, u = model.law.strength(max(float(np.max(z)), model.sigma_ppm)), model.law.ln_strength_u
        l = np.full(len(places_m), about)
        spread = np.full(len(places_m), u)
        for _ in range(STEPS):
            c = np.exp(l) * unit
            weight = c / (model.sigma_ppm**2 + (relative * np.maximum(c, z)) ** 2)
            spread = 1.0 / np.sqrt(np.sum(weight * c, axis=0) + u**-2)
            l = l + np.clip(spread**2 * (np.sum(weight * (z - c), axis=0) - (l - about) / u**2), -1.0, 1.0)
        tried = l[:, None] + spread[:, None] * np.linspace(-WIDE, WIDE, self.strengths + 2)[1:-1]
        c = np.exp(tried) * unit[:, :, None]  # (m, j, a)
        variance = model.sigma_ppm**2 + (relative[:, :, None] * c) ** 2
        fit = -0.5 * np.sum((z[:, :, None] - c) ** 2 / variance + np.log(variance), axis=0)
        return tried, fit - 0.5 * ((tried - about) / u) ** 2 + np.log(spread)[:, None]

    def expected(self, cloud: Cloud, noses_m: Array) -> tuple[Array, Array]:
        """Mean and standard deviation (k, j, a) ppm of a signal at noses (k, 3) m, for every place and strength of the cloud."""
        unit, relative = self.unit(noses_m, cloud.places_m, cloud.cell_m)
        mean = np.exp(cloud.ln_strength) * unit[:, :, None]
        return mean, np.sqrt(self.view.model.sigma_ppm**2 + (relative[:, :, None] * mean) ** 2)


def posterior(likelihood: Likelihood, count: int, zooms: int) -> Cloud:
    """A cloud of `count` places; before, the source is anywhere in the nose's box."""
    low, high = np.array(likelihood.view.arm.box_low_m), np.array(likelihood.view.arm.box_high_m)
    cloud = _drawn(likelihood, low, high, count)
    for _ in range(zooms):
        w = np.sum(cloud.weight, axis=1)
        mean = w @ cloud.places_m
        keep = MARGIN * np.sqrt(w @ (cloud.places_m - mean) ** 2) + cloud.cell_m
        low, high = np.maximum(low, mean - keep), np.minimum(high, mean + keep)
        cloud = _drawn(likelihood, low, high, count)
    return cloud


def _drawn(likelihood: Likelihood, low: Array, high: Array, count: int) -> Cloud:
    places, cell = low + _points(count) * (high - low), (high - low) / np.cbrt(count)
    tried, ln = likelihood.ln(places, cell)
    weight = np.exp(ln - np.max(ln))
    return Cloud(places, cell, tried, weight / np.sum(weight))


@cache
def _points(count: int) -> Array:
    """Halton's points, whose digits take longer than the rest."""
    points = halton(count)
    points.flags.writeable = False
    return points
