"""The delay of gas stamps behind joint stamps, by profile likelihood (see `oio.gas.timing` for what a delay is)."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from oio.gas.timing import Delay, shift_path
from oio.inference.forward_model import Problem
from oio.inference.map_fit import Fit, solve

SEARCH_SIGMAS, GOLDEN_STEPS = 3.0, 12  # standard deviations searched either side; each step narrows them to 0.618: to 1/50 of one
GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
CURVATURE_STEP = 0.25  # of the prior's standard deviation: from where to where the curvature is taken


def fit_delay(problem: Problem, prior: Delay, fit: Callable[[Problem], Fit]) -> Delay:
    """The delay of greatest profile likelihood of a problem on the unshifted path, with its prior; its variance is 2 / (-2 ln L)''.

    `fit` says how gas fluctuates once the delay is nearly right; a wrong delay looks like fluctuation, so it is asked twice.
    """
    most_s, found_s, curve = prior.s + SEARCH_SIGMAS * prior.u_s, prior.s, 0.0

    def at(delay_s: float) -> Problem:
        return replace(problem, sniffs=shift_path(problem.sniffs, delay_s, most_s))  # the same readings whatever the delay

    for _ in range(2):
        begun = fit(at(found_s))

        def cost(delay_s: float, begun: Fit = begun) -> float:
            there = replace(at(delay_s), law=begun.law)
            return solve(there, begun.mean, begun.fluctuation).chi2 + ((delay_s - prior.s) / prior.u_s) ** 2

        found_s = golden(cost, max(prior.s - SEARCH_SIGMAS * prior.u_s, 0.0), most_s)
        h = CURVATURE_STEP * prior.u_s
        low, high = max(found_s - h, 0.0), found_s + h
        below, here, above = cost(low), cost(found_s), cost(high)
        curve = 2.0 * ((above - here) / (high - found_s) - (here - below) / max(found_s - low, 1e-9)) / (high - low)
    return Delay(found_s, min(float(np.sqrt(2.0 / max(curve, 1e-12))), prior.u_s))


def golden(cost: Callable[[float], float], low: float, high: float) -> float:
    """Where a function of one hill is least (golden section; Kiefer 1953)."""
    a, b = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_a, at_b = cost(a), cost(b)
    for _ in range(GOLDEN_STEPS):
        if at_a < at_b:
            high, b, at_b = b, a, at_a
            a = high - GOLDEN * (high - low)
            at_a = cost(a)
        else:
            low, a, at_a = a, b, at_b
            b = low + GOLDEN * (high - low)
            at_b = cost(b)
    return a if at_a < at_b else b
