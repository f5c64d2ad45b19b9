"""Lower bounds on the source covariance along the executed path: Cramer-Rao (unbiased estimator), van Trees (with a prior).

Both keep the calibrated prior of the nuisance parameters; they differ in whether the source has a prior. Cramer-Rao holds at one truth,
van Trees on average over all truths under the prior.
"""

import itertools
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
    return _bound(problem, _without_source(problem) + _information(problem, known, theta))


def cramer_rao_over_time(sniffs: Sniffs, known: Prior, theta: Array, most: int) -> tuple[tuple[float, float], ...]:
    """Cramer-Rao bound (time [s], root mean square [m]) of the readings up to each of at most `most` times, the last reading's among them;
    times at which a direction is still unobservable are left out. Whitened rows are those of the readings before them alone, so one pass
    gives all of it."""
    problem = search_problem(sniffs, known)
    prior, rows = _without_source(problem), _whitened(problem, known, theta)
    steps = np.unique(np.linspace(0, len(rows), min(most, len(rows)) + 1).astype(int))
    information, out = prior, list[tuple[float, float]]()
    for begin, end in itertools.pairwise(steps):
        information = information + rows[begin:end].T @ rows[begin:end]
        rms_m = _bound(problem, information).rms_m
        if np.isfinite(rms_m):
            out.append((float(sniffs.reading_t_s[end - 1]), rms_m))
    return tuple(out)


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
    rows = _whitened(problem, known, theta)
    return np.asarray(rows.T @ rows)


def _whitened(problem: Problem, known: Prior, theta: Array) -> Array:
    """Jacobian (m, P) of the readings at theta, in their own independent standard deviations."""
    expected = problem.predict(theta)
    return whiten(expected.rows, expected.along, known.model.fluctuation).rows


def _without_source(problem: Problem) -> Array:
    """Information (P, P) of the prior, without what it says of the source's position and strength."""
    prior = np.asarray(np.linalg.inv(problem.cov), dtype=np.float64)
    prior[: LN_STRENGTH + 1, :] = prior[:, : LN_STRENGTH + 1] = 0.0
    return prior


def _bound(problem: Problem, information: Array) -> Bound:
    scale = np.sqrt(np.diag(problem.cov))  # metres, ppm and rad/s^2 in one matrix are ill conditioned
    try:
        marginal = marginal_information(scale[:, None] * information * scale)
    except np.linalg.LinAlgError:  # nothing is known of the strength: no reading in gas yet
        return Bound(np.diag(np.full(3, np.inf)))
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
