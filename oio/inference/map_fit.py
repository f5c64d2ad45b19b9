"""Maximum a posteriori fit of source, law, lag, gains, offsets and encoder drift to one trace of readings (see
`oio.inference.forward_model`).

Known things enter as tight priors, so that one fit serves the beacon (s known) and the search (s unknown).
"""

from dataclasses import dataclass

import numpy as np

from oio.core.records import Array
from oio.gas.fluctuation import Fluctuation, PathField, Whitening
from oio.gas.range_law import SOURCE, RangeLaw
from oio.inference.forward_model import ParameterLayout, Prediction, Problem

MAX_STEPS = 20  # at most
FREEZE_WHITENING_AFTER = 8  # after so many steps the whitening is frozen, so that answer and weights cannot chase each other
NEWTON_DECREMENT = 2e-3  # squared posterior standard deviations
MAX_STEP = 2.0  # prior standard deviations that one step may go in one parameter


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Answer of `solve`: mean and cov of theta, -2 ln posterior up to a constant, lagged mean concentration at the end of the trace;
    and what it was made with."""

    layout: ParameterLayout
    mean: Array
    cov: Array
    chi2: float
    lagged_ppm: float
    fluctuation: Fluctuation
    readings: int
    law: RangeLaw

    @property
    def source(self) -> Array:
        """Where the source is (3,) m."""
        return np.asarray(self.mean[SOURCE])

    @property
    def source_cov(self) -> Array:
        """Its covariance (3, 3) m^2."""
        return np.asarray(self.cov[SOURCE, SOURCE])


def solve(problem: Problem, start: Array, noise: Fluctuation) -> Fit:
    """MAP from one start theta (P,) by Levenberg-Marquardt in units of the prior, theta = mean + L u with L L' = prior.

    The whitening follows the answer from step to step; a step is judged with the whitening at its beginning. It ends when the Newton
    decrement, the squared step in posterior standard deviations, is below STEP2, or after STEPS steps.
    """
    root = np.asarray(np.linalg.cholesky(problem.cov), dtype=np.float64)
    u: Array = np.asarray(np.linalg.solve(root, start - problem.mean), dtype=np.float64)
    damping, expected = 1e-3, problem.predict(problem.mean + root @ u)
    whitening, nothing = Whitening(expected.along, noise), np.eye(len(u))
    for i in range(MAX_STEPS):
        whitening = Whitening(expected.along, noise) if 0 < i < FREEZE_WHITENING_AFTER else whitening
        both = np.concatenate([problem.residual(problem.mean + root @ u, expected.ppm)[:, None], expected.rows], axis=1)
        white = whitening.of(both, expected.along.variance_ppm2).rows
        rows, before = white[:, 1:] @ root, float(white[:, 0] @ white[:, 0] + u @ u)
        hessian, slope = rows.T @ rows + nothing, rows.T @ white[:, 0] - u
        step, damping, expected = _step(problem, (u, root, expected), whitening, (hessian, slope, before), damping)
        u = u + step
        if step @ hessian @ step < NEWTON_DECREMENT:
            break
    return _finished(problem, problem.mean + root @ u, root, noise, expected)


def _step(
    problem: Problem, at: tuple[Array, Array, Prediction], whitening: Whitening, quadratic: tuple[Array, Array, float], damping: float
) -> tuple[Array, float, Prediction]:
    """A step that lowers the cost, the damping to begin the next one with, and what is expected there; a step of zero if none does."""
    (u, root, here), (hessian, slope, before) = at, quadratic
    diagonal = np.diag(np.diag(hessian))
    while damping < 1e8:
        step = np.linalg.solve(hessian + damping * diagonal, slope)
        step = step * min(1.0, MAX_STEP / max(float(np.max(np.abs(step))), 1e-12))
        theta = problem.mean + root @ (u + step)
        there = problem.predict(theta)  # with its derivatives: most tries are steps
        residual = problem.residual(theta, there.ppm)[:, None]
        white = whitening.of(residual, there.along.variance_ppm2).rows[:, 0]  # a censored reading may have begun to tell something
        after = float(white @ white + (u + step) @ (u + step))
        if after <= before:
            return np.asarray(step), damping * 0.2, there
        damping *= 8.0
    return np.zeros_like(u), damping, here


def _finished(problem: Problem, theta: Array, root: Array, noise: Fluctuation, expected: Prediction) -> Fit:
    whitening, variance = Whitening(expected.along, noise), expected.along.variance_ppm2
    told = whitening.of(expected.rows, variance).rows
    rows = told @ root
    cov = root @ np.linalg.inv(rows.T @ rows + np.eye(len(theta))) @ root.T
    cov[SOURCE, SOURCE] += discrepancy_m(problem, theta, told[:, SOURCE], expected.along) ** 2 / 3.0 * np.eye(3)
    u = np.linalg.solve(root, theta - problem.mean)
    white = whitening.of(problem.residual(theta, expected.ppm)[:, None], variance)
    fit = white.minus_2_log_likelihood - float(np.sum(np.log(white.expected_ppm2[problem.sniffs.censored])))  # Phi has no density
    return Fit(problem.layout, theta, 0.5 * (cov + cov.T), fit + float(u @ u), expected.lagged_ppm, noise, len(expected.ppm), problem.law)


def discrepancy_m(problem: Problem, theta: Array, told: Array, along: PathField) -> float:
    """How far [m] a plume that strays from its law displaces the source, however often it is sniffed at: d r = r d(ln c) / n.

    A plume strays by the same at the same place, so more sniffs there do not average it. `told` (m, 3) is what each reading tells of the
    source; r is the mean distance of the readings, weighted by that.
    """
    weight = np.einsum("ij,ij->i", told, told)
    r_m = float(weight @ along.field.r_m[along.at]) / max(float(np.sum(weight)), 1e-300)
    return problem.law.model_discrepancy * r_m / max(float(theta[problem.layout.exponent]), 0.1)
