"""What the filters of sigma points share: points about a belief whose scales differ by 20 orders, and the belief that they become."""

from collections.abc import Callable

import numpy as np
from filterpy.kalman import unscented_transform

from oio.core.records import Array, Belief, JointState, seconds
from oio.estimators.propagation import add_process_noise, propagate_mean
from oio.inference.state_space import StateSpace

MIN_EIGENVALUE = 1e-12  # eigenvalue of a correlation matrix that rounding has made negative


def propagate(
    model: StateSpace, belief: Belief, joints: JointState, unit: Callable[[Array], Array], weights: tuple[Array, Array]
) -> Belief:
    """The belief at the time of `joints`. `unit` makes points (k, N) about 0 of a correlation matrix (N, N); weights (k,) of mean and cov.

    Q is added, as it is at the mean: the fluctuation that the points carry is that of m.
    """
    dt_s, sd = seconds(joints.t_ns - belief.t_ns), np.sqrt(np.maximum(np.diag(belief.cov), 1e-60))
    points = belief.mean + sd * unit(nearest_positive_definite(belief.cov / np.outer(sd, sd)))
    mean, cov = unscented_transform(propagate_mean(model, points, dt_s, joints), *weights)
    return Belief(joints.t_ns, mean, add_process_noise(model, belief.mean, cov, dt_s, joints))


def nearest_positive_definite(correlation: Array) -> Array:
    """The matrix itself, or if rounding keeps Cholesky from it, the nearest whose eigenvalues are at least LEAST."""
    try:
        np.linalg.cholesky(correlation - 0.1 * MIN_EIGENVALUE * np.eye(len(correlation)))
        return correlation
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(correlation)
        return np.asarray((vectors * np.maximum(values, MIN_EIGENVALUE)) @ vectors.T)
