"""Cramer-Rao bound of the source along the executed path, nuisance parameters with the prior that calibration gave them."""

import numpy as np

from oio.beliefs import problem_of, with_strength, without_source
from oio.fluctuation import whiten
from oio.knowledge import Knowledge
from oio.records import Array
from oio.trace import Sniffs


def cramer_rao(sniffs: Sniffs, known: Knowledge, theta: Array) -> float:
    """sqrt(tr C_s) [m] at theta (P,): C the inverse of the information of the readings plus the prior of everything but the source.

    Kay 1993, 3.9; inverting the whole matrix and taking the block of s is the Schur complement of the nuisance parameters.
    """
    problem = problem_of(sniffs, known)
    expected = problem.predict(theta)
    rows = whiten(expected.rows, expected.along, known.model.fluctuation).rows
    prior = np.linalg.inv(problem.cov)
    prior[:4, :] = prior[:, :4] = 0.0  # nobody told where the source is, or how strong
    scale = np.sqrt(np.diag(problem.cov))
    information = scale[:, None] * (rows.T @ rows + prior) * scale
    covariance = scale[:, None] * np.linalg.pinv(information, hermitian=True) * scale
    return float(np.sqrt(np.trace(covariance[:3, :3])))


def at_truth(sniffs: Sniffs, known: Knowledge, theta: Array, source_m: Array) -> Array:
    """theta with the source at its true place (3,) m and the strength that fits best there: where the bound is evaluated."""
    start = np.array(theta)
    start[:3] = source_m
    problem = problem_of(sniffs, known)
    return with_strength(problem, start, known.model.fluctuation.gamma, without_source(problem, start))[1]
