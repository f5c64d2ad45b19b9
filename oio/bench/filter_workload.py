"""Workload for timing filters: a swinging arm, readings equal to their prediction, and the EKF's matrices along that trajectory."""

from dataclasses import dataclass

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

from oio.cli.experiment import Experiment
from oio.core.records import Array, Belief, GasReading, JointState, nanoseconds
from oio.estimators.base import Estimator, Initializer
from oio.estimators.ekf import Ekf
from oio.estimators.odometry import begin_from_best
from oio.inference.initial_belief import initial_belief
from oio.inference.map_fit import Fit
from oio.inference.prior import cold_prior
from oio.inference.state_space import StateSpace

STEP_S = 0.02
SWING_RAD, SWING_S = 0.2, 4.0
PPM = 5.0  # lagged concentration at the beginning
MEASUREMENTS = 10


@dataclass(frozen=True)
class Workload:
    """Joint states and readings in turn, and the hypothesis that initialises the filters."""

    model: StateSpace
    fit: Fit
    joints: tuple[JointState, ...]
    readings: tuple[GasReading, ...]


@dataclass(frozen=True, eq=False)
class Step:
    """Matrices of one filter step."""

    mean: Array  # (N,) before it
    f: Array  # (N, N)
    q: Array
    expected_ppm: float
    h: Array  # (N,)
    r_ppm2: float


def workload(built: Experiment, steps: int) -> Workload:
    """Return the workload for the cold-start model of an experiment, source and law known to 1 % of their prior standard deviations."""
    assembly = built.stages["assemble_qr"]
    prior = cold_prior(assembly.arm, assembly.range_law, assembly.process_noise, assembly.nominal)  # type: ignore[attr-defined]
    fit = Fit(prior.layout, prior.mean, 1e-4 * prior.cov, 0.0, PPM, prior.model.fluctuation, MEASUREMENTS, prior.model.law)
    joints = tuple(_joints(built, i) for i in range(1, steps + 1))
    ekf, belief, readings = Ekf(gate_nis=25.0), initial_belief(prior.model, fit, 0, MEASUREMENTS), list[GasReading]()
    for i, state in enumerate(joints):
        belief = ekf.predict(prior.model, belief, state)
        template = GasReading(state.t_ns, i % prior.model.elements, 0.0, prior.model.sigma_ppm)
        expected, _, _ = prior.model.measurement(belief.mean, template)
        readings.append(GasReading(state.t_ns, template.element, expected, template.sigma_ppm))
        belief, _ = ekf.update(prior.model, belief, readings[-1])
    return Workload(prior.model, fit, joints, tuple(readings))


def _joints(built: Experiment, i: int) -> JointState:
    t_s, rate = i * STEP_S, 2 * np.pi / SWING_S
    ones = np.ones(built.arm.dof)
    swing, speed = SWING_RAD * np.sin(rate * t_s), SWING_RAD * rate * np.cos(rate * t_s)
    return JointState(nanoseconds(t_s), built.arm.home + swing * ones, speed * ones, -rate * rate * swing * ones)


def first_belief(ekf: Estimator, way: Workload) -> Belief:
    """Return a filter's initial belief."""
    begin = ekf.begin if isinstance(ekf, Initializer) else begin_from_best
    return begin(way.model, (way.fit,), 0, MEASUREMENTS)


def matrices(way: Workload) -> list[Step]:
    """Return the EKF's matrices along the trajectory; with readings equal to their prediction the updates leave the mean as it is."""
    mean, found = initial_belief(way.model, way.fit, 0, MEASUREMENTS).mean, list[Step]()
    for state, reading in zip(way.joints, way.readings, strict=True):
        after, f, q = way.model.transition(mean, STEP_S, state)
        expected, h, r = way.model.measurement(after, reading)
        found.append(Step(mean, f, q, expected, h, r))
        mean = after
    return found


def filterpy_alone(way: Workload, ready: list[Step]) -> None:
    """Run filterpy's ExtendedKalmanFilter on precomputed matrices."""
    begin = initial_belief(way.model, way.fit, 0, MEASUREMENTS)
    ekf = ExtendedKalmanFilter(dim_x=len(begin.mean), dim_z=1)
    ekf.x, ekf.P = np.array(begin.mean), np.array(begin.cov)
    for step, reading in zip(ready, way.readings, strict=True):
        ekf.F, ekf.Q = step.f, step.q
        ekf.predict()
        ekf.update(np.array([reading.ppm]), _jacobian, _expected, R=np.array([[step.r_ppm2]]), args=(step,), hx_args=(step,))


def _jacobian(x: Array, step: Step) -> Array:
    return step.h[None, :]


def _expected(x: Array, step: Step) -> Array:
    return np.array([step.expected_ppm])


def model_alone(way: Workload, ready: list[Step]) -> None:
    """Evaluate transition and measurement as often as an EKF does."""
    for step, state, reading in zip(ready, way.joints, way.readings, strict=True):
        after, _, _ = way.model.transition(step.mean, STEP_S, state)
        way.model.measurement(after, reading)
