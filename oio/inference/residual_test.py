"""Self-test of a fit by its own whitened residuals, which are independent with unit variance if the world is the one that is assumed."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from oio.core.records import Array
from oio.gas.fluctuation import Fluctuation
from oio.gas.range_law import MAX_DISCREPANCY
from oio.gas.whitening import whiten
from oio.inference.forward_model import Problem
from oio.inference.likelihoods import minus_2_log_likelihoods
from oio.inference.map_fit import Fit, solve
from oio.inference.metrics import ResidualTest, nees

RAISED = (1.0, 1.6, 2.7, 4.5, 7.5)  # factors by which the fluctuation may be larger than at calibration,
DISCREPANCIES = (1.0, 2.0, 4.0)  # the model discrepancy,
SLOWER = (1.0, 2.7)  # and the correlation time


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """Fit of one world, and its problem."""

    problem: Problem
    fit: Fit


def residual_test(problem: Problem, fit: Fit) -> ResidualTest:
    """Test a fit of a problem."""
    e = _whitened_residuals(problem, fit)
    square = float(np.mean(e * e))
    return ResidualTest(square, float(np.mean(e[1:] * e[:-1])) / max(square, 1e-300) if len(e) > 1 else 0.0)


def split_half(problem: Problem, fit: Fit) -> float:
    """Refit two halves of the readings, by time and by place, and return the larger squared Mahalanobis distance of their sources.

    By time: before and after the median of the readings in the nearer half. By place: on either side of the source, along the axis on
    which the nearer half spreads most. The halves share their prior, so the distance is rather smaller than chi-square has it.
    """
    sniffs = problem.sniffs
    away = problem.nose(fit.mean)[sniffs.at] - fit.source
    r = np.linalg.norm(away, axis=1)
    near = r <= np.median(r)
    axis = np.linalg.svd(away[near] - np.mean(away[near], axis=0), full_matrices=False)[2][0]
    by_time, by_place = sniffs.reading_t_s <= np.median(sniffs.reading_t_s[near]), away @ axis <= np.median((away @ axis)[near])
    return max(_disagreement(problem, fit, half) for half in (by_time, by_place))


def _disagreement(problem: Problem, fit: Fit, half: NDArray[np.bool_]) -> float:
    one, other = (solve(replace(problem, sniffs=problem.sniffs.only(part)), fit.mean, fit.fluctuation) for part in (half, ~half))
    return nees(one.source - other.source, one.source_cov + other.source_cov)


def _whitened_residuals(problem: Problem, fit: Fit) -> Array:
    expected = problem.predict(fit.mean, False)
    return np.asarray(whiten(problem.residual(fit.mean, expected.ppm)[:, None], expected.along, fit.fluctuation).rows[1:, 0])


def with_raised_noise(minima: list[Candidate], min_evidence: float) -> list[Candidate]:
    """Return the minima of one world, best first, with fluctuation, discrepancy and correlation time raised to the likeliest of some
    factors for the best, if that is likelier by `min_evidence` in -2 ln L; else as they are.

    They are never lowered: what calibration saw of the air can come back.
    """
    problem, fit = minima[0].problem, minima[0].fit
    law, noise = problem.law, fit.fluctuation
    expected = problem.predict(fit.mean, False)
    residual = problem.residual(fit.mean, expected.ppm)
    choices = [(gamma, w) for gamma in RAISED for w in DISCREPANCIES]
    shapes = [(expected.along.field.slope_m, w * law.model_discrepancy, gamma * noise.gamma) for gamma, w in choices]
    costs = minus_2_log_likelihoods(residual, expected.along, noise, shapes, noise.t_s * np.array(SLOWER))
    i, j = np.unravel_index(int(np.argmin(costs)), costs.shape)
    if costs[0, 0] - costs[i, j] < min_evidence:
        return minima
    gamma, w = choices[i]
    wider = replace(problem, law=replace(law, model_discrepancy=min(w * law.model_discrepancy, MAX_DISCREPANCY)))
    raised = replace(noise, gamma=gamma * noise.gamma, t_s=SLOWER[j] * noise.t_s)
    return [Candidate(wider, _again(wider, minimum.fit, raised)) for minimum in minima]


def _again(problem: Problem, fit: Fit, noise: Fluctuation) -> Fit:
    again = solve(problem, fit.mean, noise)
    evidence = again.minus_2_log_evidence + fit.charged
    return replace(
        again, world=fit.world, minus_2_log_evidence=evidence, charged=fit.charged, cov=fit.inflation * again.cov, inflation=fit.inflation
    )
