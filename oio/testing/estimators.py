"""Conformance tests of filters."""

from dataclasses import replace

import numpy as np

from oio.core.records import Belief, GasReading, Innovation, JointState
from oio.estimators.base import Estimator
from oio.inference.state_space import StateSpace
from oio.testing.assertions import bitwise, require, require_frozen

ROUNDING = 1e-9  # of a correlation matrix


def check_estimator(estimator: Estimator, model: StateSpace, belief: Belief, joints: JointState, reading: GasReading) -> None:
    """Check a filter: inputs unchanged, covariances symmetric positive definite, an update narrows, a gated one changes nothing.

    `joints` are later than `belief`; `reading` has the time of `joints` and is near enough to its prediction to pass the gate.
    """
    require_frozen(estimator)
    require(joints.t_ns > belief.t_ns, "check_estimator is to be given joints that are later than the belief.")
    before = [bitwise(given) for given in (belief, joints, reading)]
    predicted = estimator.predict(model, belief, joints)
    require(predicted.t_ns == joints.t_ns, f"a prediction is of the time of the joints, {joints.t_ns} ns, not {predicted.t_ns} ns.")
    _check_belief(model, predicted, "predict")
    updated, innovation = estimator.update(model, predicted, reading)
    _check_update(model, predicted, updated, innovation, reading)
    require(bitwise(estimator.predict(model, belief, joints)) == bitwise(predicted), "the same belief and joints give the same prediction.")
    require([bitwise(given) for given in (belief, joints, reading)] == before, "what is given to a filter is not changed by it.")
    _check_gate(estimator, model, predicted, reading)


def _check_belief(model: StateSpace, belief: Belief, verb: str) -> None:
    require(belief.mean.shape == (model.size,), f"{verb} gives a mean of the model's {model.size} states, not {belief.mean.shape}.")
    require(bool(np.all(np.isfinite(belief.mean)) and np.all(np.isfinite(belief.cov))), f"{verb} gives finite numbers.")
    require(bool(np.array_equal(belief.cov, belief.cov.T)), f"{verb} gives a symmetric covariance.")
    variance = np.diag(belief.cov)
    require(bool(np.all(variance > 0)), f"{verb} gives positive variances; the smallest is {np.min(variance)}.")
    scale = np.sqrt(variance)
    lowest = float(np.min(np.linalg.eigvalsh(belief.cov / np.outer(scale, scale))))
    require(lowest > -ROUNDING, f"{verb} gives a positive definite covariance; an eigenvalue of its correlations is {lowest}.")


def _check_update(model: StateSpace, before: Belief, after: Belief, innovation: Innovation, reading: GasReading) -> None:
    require(not innovation.gated, "check_estimator is to be given a reading that is near what is expected, but it was gated.")
    require(after.t_ns == reading.t_ns and innovation.t_ns == reading.t_ns, "an update is of the time of the reading.")
    _check_belief(model, after, "update")
    require(float(innovation.cov[0, 0]) > 0 and np.isfinite(innovation.nis), "an innovation has a positive variance.")
    _, row, _ = model.measurement(before.mean, reading)
    old, new = float(row @ before.cov @ row), float(row @ after.cov @ row)
    require(new <= old * (1 + ROUNDING), f"an update never widens the variance along H: {old} became {new} ppm^2.")


def _check_gate(estimator: Estimator, model: StateSpace, belief: Belief, reading: GasReading) -> None:
    """Only for filters with a gate."""
    outlier = replace(reading, ppm=reading.ppm + 1e12)
    after, innovation = estimator.update(model, belief, outlier)
    if innovation.gated:
        unchanged = after.mean.tobytes() == belief.mean.tobytes() and after.cov.tobytes() == belief.cov.tobytes()
        require(unchanged, "a gated reading leaves the belief as it was.")
