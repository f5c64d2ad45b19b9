"""What no estimator can beat along the executed path: Cramer-Rao for an unbiased one, van Trees for one that knows a prior as well.

Both keep the prior that calibration gave the nuisance parameters; they differ in whether anything was known of the source.
"""

from dataclasses import dataclass

import numpy as np

from oio.beliefs import problem_of, with_strength, without_source
from oio.fluctuation import whiten
from oio.knowledge import Knowledge
from oio.problem import Layout, Problem
from oio.records import Array
from oio.trace import Sniffs

NOTHING = 1e-12  # less information, of the prior's or of the best seen direction's, is rounding: the direction is open


@dataclass(frozen=True, slots=True, eq=False)
class Bound:
    """Least covariance (3, 3) m^2 of the source; infinite where the readings leave a direction open."""

    cov: Array

    @property
    def rms_m(self) -> float:
        """sqrt(tr C) [m]: least root mean square error."""
        return float(np.sqrt(np.trace(self.cov)))


def cramer_rao(sniffs: Sniffs, known: Knowledge, theta: Array) -> Bound:
    """The bound at theta (P,) if nobody told where the source is, or how strong (Kay 1993, 3.9)."""
    problem = problem_of(sniffs, known)
    prior = np.asarray(np.linalg.inv(problem.cov), dtype=np.float64)
    prior[:4, :] = prior[:, :4] = 0.0
    return _bound(problem, prior, known, theta)


def van_trees(sniffs: Sniffs, known: Knowledge, theta: Array) -> Bound:
    """The posterior bound: the whole prior counts, the source's box too (Van Trees 1968, 2.4.3).

    The information of the readings is that at theta (P,); its mean over truths is left to whoever draws them.
    """
    problem = problem_of(sniffs, known)
    return _bound(problem, np.asarray(np.linalg.inv(problem.cov), dtype=np.float64), known, theta)


def of_source(information: Array) -> Array:
    """F_s = F_ss - F_sn F_nn^-1 F_ns (3, 3): what is left of F (P, P) for the source when everything else has to be found too."""
    s, n = Layout.source, slice(Layout.source.stop, len(information))
    return np.asarray(information[s, s] - information[s, n] @ np.linalg.solve(information[n, n], information[n, s]))


def _bound(problem: Problem, prior: Array, known: Knowledge, theta: Array) -> Bound:
    expected = problem.predict(theta)
    rows = whiten(expected.rows, expected.along, known.model.fluctuation).rows
    scale = np.sqrt(np.diag(problem.cov))  # metres, ppm and rad/s^2 side by side are ill conditioned
    left = of_source(scale[:, None] * (rows.T @ rows + prior) * scale)
    values = np.linalg.eigvalsh(left)
    if values[0] <= NOTHING * max(1.0, float(values[-1])):
        return Bound(np.diag(np.full(3, np.inf)))
    return Bound(scale[:3, None] * np.linalg.inv(left) * scale[:3])


def at_truth(sniffs: Sniffs, known: Knowledge, theta: Array, source_m: Array) -> Array:
    """theta with the source at its true place (3,) m and the strength that fits best there: where the bound is evaluated."""
    start = np.array(theta)
    start[:3] = source_m
    problem = problem_of(sniffs, known)
    return with_strength(problem, start, known.model.fluctuation.gamma, without_source(problem, start))[1]
