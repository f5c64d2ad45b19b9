"""Start values of a map fit: the least-squares strength of a source at a given position, and the mirror point of a source."""

import numpy as np

from oio.core.records import Array
from oio.gas.range_law import LN_STRENGTH, SOURCE
from oio.inference.forward_model import Problem

NO_SOURCE = -60.0  # ln strength that stands for no source


def clip_strength(problem: Problem, theta: Array) -> Array:
    """Clip theta (..., P) to two standard deviations of a configured strength: fits that start farther off run out of steps."""
    if problem.law.ln_strength is None:
        return theta
    out, mean, u = np.array(theta), problem.mean[LN_STRENGTH], float(np.sqrt(problem.cov[LN_STRENGTH, LN_STRENGTH]))
    out[..., LN_STRENGTH] = np.clip(out[..., LN_STRENGTH], mean - 2.0 * u, mean + 2.0 * u)
    return out


def mirror_start(problem: Problem, theta: Array, gamma: float) -> Array:
    """Start value theta (P,) at the mirror point of the source in the best-fit plane of the nose positions, weighted by expected signal."""
    nose_m, weight = problem.nose(theta)[problem.sniffs.at], np.maximum(problem.expect(theta), 0.0) + 1e-12
    centre = weight @ nose_m / np.sum(weight)
    _, _, axes = np.linalg.svd(np.sqrt(weight)[:, None] * (nose_m - centre), full_matrices=False)
    mirrored = np.array(theta)
    mirrored[SOURCE] -= 2.0 * float(axes[-1] @ (theta[SOURCE] - centre)) * axes[-1]
    return fit_strength(problem, mirrored, gamma, readings_without_source(problem, mirrored))[1]


def readings_without_source(problem: Problem, start: Array) -> Array:
    """Expected readings (m,) [ppm] if there is no source: the decay of the lag's initial state."""
    no_source = np.array(start)
    no_source[LN_STRENGTH] = NO_SOURCE
    return problem.expect(no_source)


def fit_strength(problem: Problem, start: Array, gamma: float, left: Array) -> tuple[float, Array]:
    """Least-squares fit of the ln strength alone: weighted sum of squares, and theta (P,) with that strength.

    `left` (m,) [ppm] is the part of the readings that does not scale with the strength (`readings_without_source`). The rest scales, up
    to the switching between rise and fall, so the factor is estimated twice.
    """
    theta = np.array(start)[None, :]
    z, weight = weighted_signal(problem, start, gamma, left)
    for _ in range(2):
        cost, ln_factor = problem.grid_costs(theta, left, z, weight)
        theta[0, LN_STRENGTH] += ln_factor[0]
    return float(cost[0]), theta[0]


def weighted_signal(problem: Problem, theta: Array, gamma: float, decay: Array) -> tuple[Array, Array]:
    """Readings (m,) [ppm] above the decay of the lag's initial state, and their weights."""
    z = problem.residual(theta, decay)
    return z, 1.0 / (problem.sniffs.sigma_ppm**2 + (gamma * z) ** 2)
