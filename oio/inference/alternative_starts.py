"""Start values for the fits of alternative worlds: the calibrated world's best fit, and what differs at the best of some places by least
squares."""

import numpy as np

from oio.core.records import Array
from oio.gas.range_law import LN_STRENGTH, SOURCE, WIND
from oio.gas.source_shape import LINE, WALL
from oio.inference.forward_model import Problem
from oio.inference.map_fit import Fit
from oio.inference.sampling import halton
from oio.inference.source_strength import readings_without_source, weighted_signal

WINDS, WIND_STARTS = 6, 3  # directions of a new wind that are tried besides that of the best fit, and how many are fitted
GRID_POINTS = 64  # places of a second source that are tried
SECOND_STARTS = 2  # of which so many are fitted,
SEPARATION_M = 0.06  # and they are this far from each other
WALL_DISTANCES_M, WALL_STARTS = (0.03, 0.08), 2  # distances of a wall from the source that are tried, and how many are fitted
EXTENDED_STARTS = 2  # fits of a line, and of a ring
AXES = np.concatenate([np.eye(3), -np.eye(3)])
DIRECTIONS = np.concatenate([AXES, [[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]])
DIRECTIONS /= np.linalg.norm(DIRECTIONS, axis=1, keepdims=True)
HALF = [0, 1, 2, 10, 11, 12, 13]  # of them are not each other's opposite


def wind_starts(problem: Problem, best: Fit) -> tuple[Array, ...]:
    """Start values with a new wind: the best fit's own, and the best of some directions by least squares."""
    decay = readings_without_source(problem, best.mean)
    z, weight = weighted_signal(problem, best.mean, best.fluctuation.gamma, decay)
    starts = [np.array(best.mean) for _ in range(WINDS + 1)]
    for start, angle in zip(starts[1:], 2.0 * np.pi * np.arange(WINDS) / WINDS, strict=True):
        start[WIND] = 1.3 * problem.law.wind_per_m_u * np.array([np.cos(angle), np.sin(angle), 0.0])
    new = sorted(starts[1:], key=lambda theta: _at_best_strength(problem, theta, decay, z, weight)[0])
    return (starts[0], *new[: WIND_STARTS - 1])


def second_source_starts(problem: Problem, best: Fit) -> tuple[Array, ...]:
    """Start values with a second source: the first as fitted, the second at the best separated places of a grid by least squares."""
    low, high = np.array(problem.arm.box_low_m), np.array(problem.arm.box_high_m)
    places, decay = low + halton(GRID_POINTS) * (high - low), readings_without_source(problem, best.mean)
    first, (z, weight) = problem.expect(best.mean) - decay, weighted_signal(problem, best.mean, best.fluctuation.gamma, decay)
    candidates = []
    for place in places:
        theta = np.array(best.mean)
        theta[SOURCE] = place
        factors, cost = _two_strengths(first, problem.expect(theta) - decay, z, weight)
        theta[SOURCE], theta[LN_STRENGTH] = best.source, best.mean[LN_STRENGTH] + np.log(factors[0])
        candidates.append((cost, np.concatenate([theta, place, [np.log(factors[1] / factors[0])]])))
    starts: list[Array] = []
    n = problem.layout.size
    for _, start in sorted(candidates, key=lambda candidate: candidate[0]):
        if len(starts) < SECOND_STARTS and all(np.linalg.norm(start[n : n + 3] - other[n : n + 3]) > SEPARATION_M for other in starts):
            starts.append(start)
    return tuple(starts)


def wall_starts(problem: Problem, best: Fit) -> tuple[Array, ...]:
    """Start values with a wall: the best by least squares of some directions and distances, for the source as fitted and nearer to us."""
    feet = [distance * direction for direction in DIRECTIONS for distance in WALL_DISTANCES_M]
    return _best_shapes(problem, best, [(best.source - back * foot, foot) for foot in feet for back in (0.0, 1.0)], WALL_STARTS)


def corner_starts(problem: Problem, walled: Fit) -> tuple[Array, ...]:
    """Start values in a corner of two walls at right angles: the wall of a fit, or those of some directions if it has none, and another."""
    n, shapes = walled.layout.base, list[tuple[Array, Array]]()
    firsts = [walled.mean[n : n + 3]] if walled.extension.source == WALL else [WALL_DISTANCES_M[0] * axis for axis in AXES]
    for first in firsts:
        for second in (distance * across for across in _across(first) for distance in WALL_DISTANCES_M):
            shapes += [(walled.source - back * second, np.concatenate([first, second])) for back in (0.0, 1.0)]
    return _best_shapes(problem, walled, shapes, WALL_STARTS)


def _across(direction: Array) -> Array:
    """Eight unit vectors (8, 3) at right angles to a direction (3,)."""
    _, _, axes = np.linalg.svd(direction[None, :])
    angle = np.pi / 4.0 * np.arange(8)
    return np.asarray(np.outer(np.cos(angle), axes[1]) + np.outer(np.sin(angle), axes[2]))


def extended_source_starts(problem: Problem, best: Fit, extent_m: float) -> tuple[Array, ...]:
    """Start values of an extended source: the best by least squares of some directions, with the source as fitted at the centre or at an
    edge."""
    shapes = []
    for direction in DIRECTIONS[HALF]:
        half = 1.5 * extent_m * direction
        if problem.extension.source == LINE:
            edges = [-half, half]
        else:
            one = np.cross(direction, np.eye(3)[int(np.argmin(np.abs(direction)))])
            one *= np.linalg.norm(half) / np.linalg.norm(one)
            two = np.cross(direction, one)
            edges = [one, -one, two, -two]
        shapes += [(best.source + edge, half) for edge in (np.zeros(3), *edges)]
    return _best_shapes(problem, best, shapes, EXTENDED_STARTS)


def _best_shapes(problem: Problem, best: Fit, shapes: list[tuple[Array, Array]], count: int) -> tuple[Array, ...]:
    """The best theta by least squares, each at its best strength, of shapes: source (3,) m, and parameters of the extension."""
    n, candidates = best.layout.base, []
    base = np.concatenate([best.mean[:n], shapes[0][1]])
    decay = readings_without_source(problem, base)
    z, weight = weighted_signal(problem, base, best.fluctuation.gamma, decay)
    for source, parameters in shapes:
        theta = np.array(base)
        theta[SOURCE], theta[n:] = source, parameters
        cost, ln_factor = _at_best_strength(problem, theta, decay, z, weight)
        theta[LN_STRENGTH] += ln_factor
        candidates.append((cost, theta))
    return tuple(theta for _, theta in sorted(candidates, key=lambda candidate: candidate[0])[:count])


def _at_best_strength(problem: Problem, theta: Array, decay: Array, z: Array, weight: Array) -> tuple[float, float]:
    """Weighted sum of squares at the least-squares strength, at least 1e-3 of theta's, and ln of its ratio to that."""
    h = problem.expect(theta) - decay
    factor = max(float(h @ (weight * z)) / max(float(h @ (weight * h)), 1e-300), 1e-3)
    return float(weight @ (z - factor * h) ** 2), float(np.log(factor))


def _two_strengths(first: Array, second: Array, z: Array, weight: Array) -> tuple[Array, float]:
    """Least-squares factors of two fields (m,), at least 1e-3, and the weighted sum of squares."""
    fields = np.stack([first, second], axis=1)
    normal = fields.T @ (weight[:, None] * fields)
    ridge = max(1e-9 * float(np.trace(normal)), 1e-300)  # far from all readings both fields are zero
    factors = np.asarray(np.linalg.solve(normal + ridge * np.eye(2), fields.T @ (weight * z)), dtype=np.float64)
    for i in range(2):
        if factors[i] < 1e-3:
            factors[i], other = 1e-3, 1 - i
            factors[other] = max(float(fields[:, other] @ (weight * z)) / max(float(normal[other, other]), 1e-300), 1e-3)
    residual = z - fields @ factors
    return factors, float(weight @ residual**2)
