"""Maximum a posteriori (MAP) fit of source, range law, lag, gains, offsets and encoder drift to one trace of readings (see
`oio.inference.forward_model`).

Known parameters enter as tight priors, so that one fit serves the beacon (s known) and the search (s unknown).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from oio.core.records import Array
from oio.gas.fluctuation import Fluctuation, MeanField, PathField
from oio.gas.range_law import SOURCE, RangeLaw
from oio.gas.whitening import Whitening
from oio.inference.forward_model import ParameterLayout, Prediction, Problem
from oio.inference.law_extension import UNEXTENDED, LawExtension
from oio.inference.metrics import ResidualTest

CALIBRATED = "as calibrated"  # the world that a fit assumes, unless `oio.inference.alternatives` says another
MAX_STEPS = 24  # maximum number of iterations
FREEZE_WHITENING_AFTER = 12  # iterations after which the whitening is frozen, so that estimate and weights cannot oscillate
NEWTON_DECREMENT = 2e-3  # convergence limit, in squared posterior standard deviations
ROUGH_ABOVE = 4.0  # mean square of the whitened residuals at a start, above which noise is at first in proportion to the readings,
ROUGH_STEPS, ROUGH_DECREMENT = 5, 1.0  # for so many iterations at most, or until convergence to this limit
MAX_STEP = 2.0  # step limit per parameter, in prior standard deviations


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Result of `solve`: mean and cov of theta, `chi2` = -2 ln posterior up to a constant, lagged mean concentration at the end of the
    trace (`lagged_ppm_at`: at each place, if the sensor has two); the fluctuation, number of readings and range law of the fit; -2 ln of
    its evidence (see `minus_2_log_evidence`), the extension of the law, and what world it assumes."""

    layout: ParameterLayout
    mean: Array
    cov: Array
    chi2: float
    lagged_ppm: float
    fluctuation: Fluctuation
    readings: int
    law: RangeLaw
    minus_2_log_evidence: float = np.inf
    extension: LawExtension = UNEXTENDED
    world: str = CALIBRATED
    charged: float = 0.0  # prior odds against that world, in -2 ln, within the evidence
    inflation: float = 1.0  # of the covariance
    residuals: ResidualTest | None = None  # of the best hypothesis of a map
    lagged_ppm_at: tuple[float, ...] = ()

    @property
    def source(self) -> Array:
        """Estimated source position (3,) [m]."""
        return np.asarray(self.mean[SOURCE])

    @property
    def source_cov(self) -> Array:
        """Covariance of the source position (3, 3) [m^2]."""
        return np.asarray(self.cov[SOURCE, SOURCE])


def solve(problem: Problem, start: Array, noise: Fluctuation) -> Fit:
    """MAP estimate from one start theta (P,) by Levenberg-Marquardt in units of the prior, theta = mean + L u with L L' = prior cov.

    The whitening is updated at every iteration; a step is judged with the whitening at its beginning. From a start that does not explain
    the readings, where next to no gas and so next to no noise may be expected, the first steps take the noise in proportion to the
    readings. Converged when the Newton decrement, the squared step in posterior standard deviations, is below NEWTON_DECREMENT, or after
    MAX_STEPS iterations.
    """
    root = np.asarray(np.linalg.cholesky(problem.cov), dtype=np.float64)
    u: Array = np.asarray(np.linalg.solve(root, start - problem.mean), dtype=np.float64)
    damping, expected = 1e-3, problem.predict(problem.mean + root @ u)
    whitening, identity = Whitening(expected.along, noise), np.eye(len(u))
    at_start = whitening.of(problem.residual(start, expected.ppm)[:, None], expected.along.variance_ppm2)
    rough = float(np.mean(np.square(at_start.rows))) > ROUGH_ABOVE
    if rough:
        whitening = _weighed_by_readings(problem, start, expected, noise)
    for i in range(MAX_STEPS):
        if not rough and i < FREEZE_WHITENING_AFTER:
            whitening = Whitening(expected.along, noise)
        stacked = np.concatenate([problem.residual(problem.mean + root @ u, expected.ppm)[:, None], expected.rows], axis=1)
        white = whitening.of(stacked, expected.along.variance_ppm2).rows
        rows, cost = white[:, 1:] @ root, float(white[:, 0] @ white[:, 0] + u @ u)
        hessian, gradient = rows.T @ rows + identity, rows.T @ white[:, 0] - u
        step, damping, expected = _damped_step(problem, (u, root, expected), whitening, (hessian, gradient, cost), damping)
        u = u + step
        decrement = step @ hessian @ step
        if decrement < NEWTON_DECREMENT and not rough:
            break
        if rough and (decrement < ROUGH_DECREMENT or i + 1 >= ROUGH_STEPS):
            rough, damping, whitening = False, 1e-3, Whitening(expected.along, noise)
    return _result(problem, problem.mean + root @ u, root, noise, expected)


def _weighed_by_readings(problem: Problem, theta: Array, expected: Prediction, noise: Fluctuation) -> Whitening:
    """Whitening of a fluctuation in proportion to what was read instead of what is expected at theta."""
    sniffs, along = problem.sniffs, expected.along
    read = np.maximum(sniffs.ppm - theta[problem.layout.baseline][sniffs.element], sniffs.sigma_ppm) / along.gain
    if along.second is None:
        return Whitening(replace(along, field=_as_read(along.field, sniffs.at, read)), noise)
    there = along.second.is_second
    second = replace(along.second, field=_as_read(along.second.field, sniffs.at[there], read[there]))
    return Whitening(replace(along, field=_as_read(along.field, sniffs.at[~there], read[~there]), second=second), noise)


def _as_read(field: MeanField, at: NDArray[np.int64], read_ppm: Array) -> MeanField:
    """The field (k,) with the concentration of readings (m,) [ppm] at these indices of the path, and no rarity."""
    mean_ppm = np.interp(np.arange(len(field.mean_ppm)), at, read_ppm)
    return replace(field, mean_ppm=mean_ppm, rarity=np.ones_like(mean_ppm))


def _damped_step(
    problem: Problem, at: tuple[Array, Array, Prediction], whitening: Whitening, quadratic: tuple[Array, Array, float], damping: float
) -> tuple[Array, float, Prediction]:
    """One damped step that does not raise the cost, the damping to start the next with, and the prediction; a zero step if none exists."""
    (u, root, current), (hessian, gradient, cost) = at, quadratic
    diagonal = np.diag(np.diag(hessian))
    while damping < 1e8:
        step = np.linalg.solve(hessian + damping * diagonal, gradient)
        step = step * min(1.0, MAX_STEP / max(float(np.max(np.abs(step))), 1e-12))
        theta = problem.mean + root @ (u + step)
        proposed = problem.predict(theta)  # with its Jacobian: most trial steps are accepted
        residual = problem.residual(theta, proposed.ppm)[:, None]
        white = whitening.of(residual, proposed.along.variance_ppm2).rows[:, 0]  # the variance of a censored reading depends on theta
        new_cost = float(white @ white + (u + step) @ (u + step))
        if new_cost <= cost:
            return np.asarray(step), damping * 0.2, proposed
        damping *= 8.0
    return np.zeros_like(u), damping, current


def _result(problem: Problem, theta: Array, root: Array, noise: Fluctuation, expected: Prediction) -> Fit:
    whitening, variance = Whitening(expected.along, noise), expected.along.variance_ppm2
    white_rows = whitening.of(expected.rows, variance).rows
    rows = white_rows @ root
    hessian = rows.T @ rows + np.eye(len(theta))
    cov = root @ np.linalg.inv(hessian) @ root.T
    cov[SOURCE, SOURCE] += discrepancy_m(problem, theta, white_rows[:, SOURCE], expected.along) ** 2 / 3.0 * np.eye(3)
    u = np.linalg.solve(root, theta - problem.mean)
    white = whitening.of(problem.residual(theta, expected.ppm)[:, None], variance)
    fit = white.minus_2_log_likelihood - float(np.sum(np.log(white.expected_ppm2[problem.sniffs.censored])))  # Phi is no density
    chi2 = fit + float(u @ u)
    evidence = chi2 + float(np.linalg.slogdet(hessian)[1])  # Laplace's approximation: the prior is a unit normal in u, and its volume is 1
    return Fit(
        problem.layout, theta, 0.5 * (cov + cov.T), chi2, expected.lagged_ppm, noise, len(expected.ppm), problem.law,
        evidence, problem.extension, lagged_ppm_at=expected.lagged_ppm_at,
    )  # fmt: skip


def discrepancy_m(problem: Problem, theta: Array, told: Array, along: PathField) -> float:
    """Source error [m] due to model discrepancy of the range law, which more readings do not reduce: d r = r d(ln c) / n.

    The discrepancy is the same at the same place, so more readings there do not average it out. `told` (m, 3) is the whitened Jacobian
    by the source position; r is the mean distance of the readings, weighted by its square.
    """
    weight = np.einsum("ij,ij->i", told, told)
    r_m = float(weight @ along.r_of_readings) / max(float(np.sum(weight)), 1e-300)
    return problem.law.model_discrepancy * r_m / max(float(theta[problem.layout.exponent]), 0.1)
