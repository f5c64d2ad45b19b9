"""Model selection of the range law on the beacon's readings, by BIC: each candidate holds some parameters fixed, the rest are free.

ln c = l - n ln(r / r_ref) - (|k| r - k.d) - u r is the full model. The Bayesian information criterion, BIC = -2 ln L + p ln N (Schwarz
1978), penalises every free parameter; N is the effective sample size: readings within one eddy are not independent evidence.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from oio.gas.fluctuation import Fluctuation, PathField
from oio.gas.range_law import EXPONENT, KX, KY, KZ, LAW, THINNING
from oio.inference.forward_model import ParameterLayout, Problem
from oio.inference.map_fit import Fit
from oio.inference.prior import FIXED

HELD_BY_FORM: dict[str, dict[int, float]] = {  # index in theta and value of fixed parameters: n = 1 is diffusion from a point, k = 0, u = 0
    "log_distance": {KX: 0.0, KY: 0.0, KZ: 0.0, THINNING: 0.0},
    "isotropic": {EXPONENT: 1.0, KX: 0.0, KY: 0.0, KZ: 0.0},
    "advection_diffusion": {EXPONENT: 1.0, THINNING: 0.0},
    "all": {},
}
HELD_BELOW = 1e-3  # a parameter whose standard deviation is below this was held fixed


def hold_parameters(problem: Problem, air: str) -> Problem:
    """Return the problem with the parameters that a law form holds fixed, at standard deviation FIXED."""
    mean, cov = np.array(problem.mean), np.array(problem.cov)
    for index, value in HELD_BY_FORM[air].items():
        mean[index] = value
        cov[index, :] = cov[:, index] = 0.0
        cov[index, index] = FIXED**2
    return replace(problem, mean=mean, cov=cov)


def law_form(fit: Fit) -> str:
    """Return the law form of a fit, from which of its parameters have no variance."""
    held = {index for index in range(ParameterLayout.exponent, LAW) if fit.cov[index, index] < HELD_BELOW**2}
    return next((form for form, values in HELD_BY_FORM.items() if set(values) == held), "all")


def effective_sample_size(along: PathField, noise: Fluctuation) -> float:
    """Effective sample size N of the readings along a path, at most their number.

    A record of length D counts as D / 2 T independent readings (Bayley & Hammersley 1946); T, the integral time scale of the lagged
    fluctuation, is the sum of lag and correlation time.
    """
    times_s = along.tau_s + 1.0 / noise.rate(along.field)
    return float(np.clip(1.0 + np.sum(along.dt_s / (2.0 * times_s)), 1.0, max(len(along.at), 1)))


def bic(problem: Problem, fit: Fit) -> float:
    """Bayesian information criterion of a fit of a restricted problem; the prior's part of the cost is subtracted."""
    error = fit.mean - problem.mean
    along = problem.predict(fit.mean).along
    free = LAW - ParameterLayout.exponent - len(HELD_BY_FORM[law_form(fit)])
    return (
        fit.chi2 - float(error @ np.linalg.solve(problem.cov, error)) + free * float(np.log(effective_sample_size(along, fit.fluctuation)))
    )


def lowest_bic(candidates: Iterable[tuple[Problem, Fit]]) -> Fit:
    """Return the fit of lowest BIC."""
    return min(candidates, key=lambda pair: bic(*pair))[1]
