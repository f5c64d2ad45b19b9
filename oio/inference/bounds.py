"""Lower bounds on the source covariance along the executed path: Cramer-Rao (unbiased estimator), van Trees (with a prior).

Both keep the calibrated prior of the nuisance parameters; they differ in whether the source has a prior. Cramer-Rao holds at one truth,
van Trees on average over all truths under the prior.
"""

from dataclasses import dataclass

import numpy as np

from oio.core.records import Array
from oio.gas.range_law import LN_STRENGTH, SOURCE
from oio.gas.trace import Sniffs
from oio.gas.whitening import whiten
from oio.inference.belief_map import search_problem
from oio.inference.forward_model import ParameterLayout, Problem
from oio.inference.prior import Prior
from oio.inference.source_strength import fit_strength, readings_without_source

MIN_INFORMATION = 1e-12  # less information, relative to the prior's or the best direction's, is rounding: the direction is unobservable


@dataclass(frozen=True, slots=True, eq=False)
class Bound:
    """Lower bound on the covariance (3, 3) [m^2] of the source; infinite if the readings leave a direction unobservable."""

    cov: Array

    @property
    def rms_m(self) -> float:
        """Lower bound on the root mean square error, sqrt(tr C) [m]."""
        return float(np.sqrt(np.trace(self.cov)))


def cramer_rao(sniffs: Sniffs, known: Prior, theta: Array) -> Bound:
    """Cramer-Rao bound at theta (P,) without a prior on source position and strength (Kay 1993, 3.9)."""
    problem = search_problem(sniffs, known)
    prior = np.asarray(np.linalg.inv(problem.cov), dtype=np.float64)
    prior[: LN_STRENGTH + 1, :] = prior[:, : LN_STRENGTH + 1] = 0.0
    return _bound(problem, prior + _information(problem, known, theta))


def van_trees(sniffs: Sniffs, known: Prior, theta: Array) -> Bound:
    """Posterior (van Trees) bound with the Fisher information at one truth theta (P,): the whole prior counts, the source's box too."""
    problem = search_problem(sniffs, known)
    return _bound(problem, np.linalg.inv(problem.cov) + _information(problem, known, theta))


def posterior_cramer_rao(sniffs: Sniffs, known: Prior, rng: np.random.Generator, draws: int) -> Bound:
    """Posterior Cramer-Rao bound (E[F(theta)] + P0^-1)^-1, the mean over `draws` truths from the prior (Van Trees 1968, 2.4.3).

    The path stays the executed one, as if it did not depend on the readings, and the first reading initialises the lag.
    """
    problem = search_problem(sniffs, known)
    root = np.linalg.cholesky(problem.cov)
    truths = problem.mean + rng.standard_normal((draws, len(root))) @ root.T
    mean = np.mean([_information(problem, known, theta) for theta in truths], axis=0)
    return _bound(problem, np.linalg.inv(problem.cov) + mean)


def marginal_information(information: Array) -> Array:
    """Marginal information of the source, the Schur complement F_s = F_ss - F_sn F_nn^-1 F_ns (3, 3) of F (P, P)."""
    s, n = ParameterLayout.source, slice(ParameterLayout.source.stop, len(information))
    return np.asarray(information[s, s] - information[s, n] @ np.linalg.solve(information[n, n], information[n, s]))


def _information(problem: Problem, known: Prior, theta: Array) -> Array:
    """Fisher information (P, P) of the readings at theta; the dependence of their noise on theta is neglected."""
    expected = problem.predict(theta)
    rows = whiten(expected.rows, expected.along, known.model.fluctuation).rows
    return np.asarray(rows.T @ rows)


def _bound(problem: Problem, information: Array) -> Bound:
    scale = np.sqrt(np.diag(problem.cov))  # metres, ppm and rad/s^2 in one matrix are ill conditioned
    marginal = marginal_information(scale[:, None] * information * scale)
    values = np.linalg.eigvalsh(marginal)
    if values[0] <= MIN_INFORMATION * max(1.0, float(values[-1])):
        return Bound(np.diag(np.full(3, np.inf)))
    return Bound(scale[SOURCE, None] * np.linalg.inv(marginal) * scale[SOURCE])


def at_truth(sniffs: Sniffs, known: Prior, theta: Array, source_m: Array) -> Array:
    """theta with the source at its true position (3,) [m] and the best-fitting strength there: where the bound is evaluated."""
    problem = search_problem(sniffs, known)
    start = np.array(theta[: problem.layout.size])  # an extension of the law is left out: the bound is that of the calibrated world
    start[SOURCE] = source_m
    return fit_strength(problem, start, known.model.fluctuation.gamma, readings_without_source(problem, start))[1]
