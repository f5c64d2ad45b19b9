"""The delay of gas stamps behind joint stamps, by profile likelihood (see `oio.gas.timing` for what a delay is)."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from oio.gas.timing import Delay, shift_path
from oio.inference.forward_model import Problem
from oio.inference.map_fit import Fit, solve

SEARCH_SIGMAS, TOLERANCE_SIGMAS = 3.0, 0.02  # of the prior's standard deviation: searched either side, and to what the search is made
CURVATURE_STEP = 0.25  # likewise: half the width over which the curvature is taken


def fit_delay(problem: Problem, prior: Delay, fit: Callable[[Problem], Fit]) -> Delay:
    """Maximum a posteriori delay by profile likelihood, of a problem on the unshifted path; its variance is 2 / (-2 ln L)''.

    `fit` estimates how the gas fluctuates. A wrong delay looks like fluctuation, so it is called again at the first answer.
    """
    from scipy.optimize import minimize_scalar  # 0.15 s of import, for a fit that few runs make

    most_s, found_s, curve = prior.s + SEARCH_SIGMAS * prior.u_s, prior.s, 0.0

    def at(delay_s: float) -> Problem:
        return replace(problem, sniffs=shift_path(problem.sniffs, delay_s, most_s))  # the same readings whatever the delay

    for _ in range(2):
        begun = fit(at(found_s))

        def cost(delay_s: float, begun: Fit = begun) -> float:
            there = replace(at(delay_s), law=begun.law)
            return solve(there, begun.mean, begun.fluctuation).chi2 + ((delay_s - prior.s) / prior.u_s) ** 2

        limits, tolerance = (max(prior.s - SEARCH_SIGMAS * prior.u_s, 0.0), most_s), {"xatol": TOLERANCE_SIGMAS * prior.u_s}
        found_s = float(minimize_scalar(cost, bounds=limits, method="bounded", options=tolerance).x)
        h = CURVATURE_STEP * prior.u_s
        low, high = max(found_s - h, 0.0), found_s + h
        below, here, above = cost(low), cost(found_s), cost(high)
        curve = 2.0 * ((above - here) / (high - found_s) - (here - below) / max(found_s - low, 1e-9)) / (high - low)
    return Delay(found_s, min(float(np.sqrt(2.0 / max(curve, 1e-12))), prior.u_s))
