"""What no estimator can beat along the executed path: Cramer-Rao for an unbiased one, van Trees for one that knows a prior as well.

Both keep the prior that calibration gave the nuisance parameters; they differ in whether anything was known of the source. Cramer-Rao
holds at one truth, van Trees on average over all truths that the prior allows.
"""

from dataclasses import dataclass

import numpy as np

from oio.core.records import Array
from oio.gas.fluctuation import whiten
from oio.gas.range_law import LN_STRENGTH, SOURCE
from oio.gas.trace import Sniffs
from oio.inference.belief_map import fit_strength, readings_without_source, search_problem
from oio.inference.forward_model import ParameterLayout, Problem
from oio.inference.prior import Prior

NOTHING = 1e-12  # less information, of the prior's or of the best seen direction's, is rounding: the direction is open


@dataclass(frozen=True, slots=True, eq=False)
class Bound:
    """Least covariance (3, 3) m^2 of the source; infinite where the readings leave a direction open."""

    cov: Array

    @property
    def rms_m(self) -> float:
        """sqrt(tr C) [m]: least root mean square error."""
        return float(np.sqrt(np.trace(self.cov)))


def cramer_rao(sniffs: Sniffs, known: Prior, theta: Array) -> Bound:
    """The bound at theta (P,) if nobody told where the source is, or how strong (Kay 1993, 3.9)."""
    problem = search_problem(sniffs, known)
    prior = np.asarray(np.linalg.inv(problem.cov), dtype=np.float64)
    prior[: LN_STRENGTH + 1, :] = prior[:, : LN_STRENGTH + 1] = 0.0
    return _bound(problem, prior + _information(problem, known, theta))


def van_trees(sniffs: Sniffs, known: Prior, theta: Array) -> Bound:
    """The posterior bound with the information of one truth theta (P,): the whole prior counts, the source's box too."""
    problem = search_problem(sniffs, known)
    return _bound(problem, np.linalg.inv(problem.cov) + _information(problem, known, theta))


def posterior_cramer_rao(sniffs: Sniffs, known: Prior, rng: np.random.Generator, draws: int) -> Bound:
    """The posterior bound, (E[F(theta)] + P0^-1)^-1 with the mean over `draws` truths from the prior (Van Trees 1968, 2.4.3).

    The path stays the executed one, as if it had not been chosen for what was smelt, and the lag begins where the first reading had it.
    """
    problem = search_problem(sniffs, known)
    root = np.linalg.cholesky(problem.cov)
    truths = problem.mean + rng.standard_normal((draws, len(root))) @ root.T
    mean = np.mean([_information(problem, known, theta) for theta in truths], axis=0)
    return _bound(problem, np.linalg.inv(problem.cov) + mean)


def of_source(information: Array) -> Array:
    """F_s = F_ss - F_sn F_nn^-1 F_ns (3, 3): what is left of F (P, P) for the source when everything else has to be found too."""
    s, n = ParameterLayout.source, slice(ParameterLayout.source.stop, len(information))
    return np.asarray(information[s, s] - information[s, n] @ np.linalg.solve(information[n, n], information[n, s]))


def _information(problem: Problem, known: Prior, theta: Array) -> Array:
    """Of the readings about theta, at theta (P, P); that their noise depends on theta too is left out."""
    expected = problem.predict(theta)
    rows = whiten(expected.rows, expected.along, known.model.fluctuation).rows
    return np.asarray(rows.T @ rows)


def _bound(problem: Problem, information: Array) -> Bound:
    scale = np.sqrt(np.diag(problem.cov))  # metres, ppm and rad/s^2 side by side are ill conditioned
    left = of_source(scale[:, None] * information * scale)
    values = np.linalg.eigvalsh(left)
    if values[0] <= NOTHING * max(1.0, float(values[-1])):
        return Bound(np.diag(np.full(3, np.inf)))
    return Bound(scale[SOURCE, None] * np.linalg.inv(left) * scale[SOURCE])


def at_truth(sniffs: Sniffs, known: Prior, theta: Array, source_m: Array) -> Array:
    """theta with the source at its true place (3,) m and the strength that fits best there: where the bound is evaluated."""
    start = np.array(theta)
    start[SOURCE] = source_m
    problem = search_problem(sniffs, known)
    return fit_strength(problem, start, known.model.fluctuation.gamma, readings_without_source(problem, start))[1]
