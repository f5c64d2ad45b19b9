"""What the filters of sigma points share: points about a belief whose scales differ by 20 orders, and the belief that they become."""

from collections.abc import Callable

import numpy as np
from filterpy.kalman import unscented_transform

from oio.core.records import Array, Belief, JointState, seconds
from oio.estimators.propagation import moved, noisy
from oio.inference.state_space import Model

LEAST = 1e-12  # eigenvalue of a correlation matrix that rounding has made negative


def propagated(model: Model, belief: Belief, joints: JointState, unit: Callable[[Array], Array], weights: tuple[Array, Array]) -> Belief:
    """The belief at the time of `joints`. `unit` makes points (k, N) about 0 of a correlation matrix (N, N); weights (k,) of mean and cov.

    Q is added, as it is at the mean: the fluctuation that the points carry is that of m.
    """
    dt_s, sd = seconds(joints.t_ns - belief.t_ns), np.sqrt(np.maximum(np.diag(belief.cov), 1e-60))
    points = belief.mean + sd * unit(positive(belief.cov / np.outer(sd, sd)))
    mean, cov = unscented_transform(moved(model, points, dt_s, joints), *weights)
    return Belief(joints.t_ns, mean, noisy(model, belief.mean, cov, dt_s, joints))


def positive(correlation: Array) -> Array:
    """The matrix itself, or if rounding keeps Cholesky from it, the nearest whose eigenvalues are at least LEAST."""
    try:
        np.linalg.cholesky(correlation - 0.1 * LEAST * np.eye(len(correlation)))
        return correlation
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(correlation)
        return np.asarray((vectors * np.maximum(values, LEAST)) @ vectors.T)
