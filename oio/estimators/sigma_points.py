"""Sigma-point time update, shared by the UKF and the CKF; the states are scaled, because their scales differ by 20 orders."""

from collections.abc import Callable

import numpy as np
from filterpy.kalman import unscented_transform

from oio.core.records import Array, Belief, JointState, seconds
from oio.estimators.propagation import add_process_noise, propagate_mean
from oio.inference.state_space import StateSpace

MIN_EIGENVALUE = 1e-12  # lower bound for eigenvalues of a correlation matrix that rounding has made negative


def propagate(
    model: StateSpace, belief: Belief, joints: JointState, unit: Callable[[Array], Array], weights: tuple[Array, Array]
) -> Belief:
    """Sigma-point (unscented) time update to the time of `joints`. `unit` returns points (k, N) about 0 for a correlation matrix (N, N);
    `weights` are those of mean and covariance, (k,) each.

    Q is added as evaluated at the mean; the fluctuation in the points is that of state m.
    """
    dt_s, sd = seconds(joints.t_ns - belief.t_ns), np.sqrt(np.maximum(np.diag(belief.cov), 1e-60))
    points = belief.mean + sd * unit(nearest_positive_definite(belief.cov / np.outer(sd, sd)))
    mean, cov = unscented_transform(propagate_mean(model, points, dt_s, joints), *weights)
    return Belief(joints.t_ns, mean, add_process_noise(model, belief.mean, cov, dt_s, joints))


def nearest_positive_definite(correlation: Array) -> Array:
    """Return the matrix itself, or if Cholesky fails by rounding, the nearest one with eigenvalues of at least MIN_EIGENVALUE."""
    try:
        np.linalg.cholesky(correlation - 0.1 * MIN_EIGENVALUE * np.eye(len(correlation)))
        return correlation
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh(correlation)
        return np.asarray((vectors * np.maximum(values, MIN_EIGENVALUE)) @ vectors.T)
