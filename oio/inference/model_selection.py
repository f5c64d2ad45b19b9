"""Which law of mean concentration the beacon's readings speak for: each candidate holds some parameters of the law, the rest are free.

ln c = l - n ln(r / r_ref) - (|k| r - k.d) - u r holds them all. Every free parameter must earn its place by the Bayesian information
criterion, BIC = -2 ln L + p ln N (Schwarz 1978), with N the effective number of readings: those within one eddy are no evidence anew.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from oio.gas.fluctuation import Fluctuation, PathField
from oio.gas.range_law import EXPONENT, KX, KY, KZ, LAW, THINNING
from oio.inference.forward_model import ParameterLayout, Problem
from oio.inference.map_fit import Fit
from oio.inference.prior import FIXED

HELD_BY_FORM: dict[str, dict[int, float]] = {  # place in theta and value of what a law holds: n = 1 is diffusion from a point, k = 0, u = 0
    "log_distance": {KX: 0.0, KY: 0.0, KZ: 0.0, THINNING: 0.0},
    "isotropic": {EXPONENT: 1.0, KX: 0.0, KY: 0.0, KZ: 0.0},
    "advection_diffusion": {EXPONENT: 1.0, THINNING: 0.0},
    "all": {},
}
HELD_BELOW = 1e-3  # a parameter whose standard deviation is below this was held


def hold_parameters(problem: Problem, air: str) -> Problem:
    """The same problem with what this air holds known to FIXED."""
    mean, cov = np.array(problem.mean), np.array(problem.cov)
    for place, value in HELD_BY_FORM[air].items():
        mean[place] = value
        cov[place, :] = cov[:, place] = 0.0
        cov[place, place] = FIXED**2
    return replace(problem, mean=mean, cov=cov)


def law_form(fit: Fit) -> str:
    """The air that a fit was made with: what it held has no spread."""
    held = {place for place in range(ParameterLayout.exponent, LAW) if fit.cov[place, place] < HELD_BELOW**2}
    return next((air for air, places in HELD_BY_FORM.items() if set(places) == held), "all")


def effective_sample_size(along: PathField, noise: Fluctuation) -> float:
    """Effective number N of readings along a path, at most their number.

    A record of length D is worth D / 2 T independent readings (Bayley & Hammersley 1946); T, the integral time of the fluctuation through
    the lag, is the sum of both times.
    """
    times_s = along.tau_s + 1.0 / noise.rate(along.field)
    return float(np.clip(1.0 + np.sum(along.dt_s / (2.0 * times_s)), 1.0, max(len(along.at), 1)))


def bic(problem: Problem, fit: Fit) -> float:
    """Bayesian information criterion of a fit of a restricted problem; the prior's part of the cost is no likelihood."""
    miss = fit.mean - problem.mean
    along = problem.predict(fit.mean).along
    free = LAW - ParameterLayout.exponent - len(HELD_BY_FORM[law_form(fit)])
    return fit.chi2 - float(miss @ np.linalg.solve(problem.cov, miss)) + free * float(np.log(effective_sample_size(along, fit.fluctuation)))


def lowest_bic(candidates: Iterable[tuple[Problem, Fit]]) -> Fit:
    """The fit of the lowest BIC."""
    return min(candidates, key=lambda pair: bic(*pair))[1]
