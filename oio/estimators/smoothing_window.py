"""Sliding-window smoother (iterated Kalman smoother): Gauss-Newton over the latest readings (Bell 1994), for a nonlinear transition.

A reading measures the lagged concentration, so it is linear in the state, and iterating its update alone changes nothing. The nonlinear
part is how the gas follows the nose between readings. So the steps since an anchor belief are relinearised about the smoothed states: a
forward Kalman filter pass, a backward costate pass (modified Bryson-Frazier, Bierman 1973: no covariance is inverted), until convergence.
"""

from dataclasses import dataclass

import numpy as np

from oio.core.records import Array, Belief, GasReading, Innovation, JointState, seconds
from oio.estimators.gated_update import innovation_of, scalar_measurement, update
from oio.estimators.propagation import LinearizedStep, predict
from oio.inference.state_space import StateSpace

SensorData = tuple[JointState | GasReading, ...]


@dataclass(frozen=True, slots=True, eq=False)
class WindowedBelief(Belief):
    """A belief with its smoothing window: the anchor belief where the window begins, the joint states and readings since, and the states
    (k, N) about which its k steps are linearised."""

    anchor: Belief
    since: SensorData
    path: Array


@dataclass(frozen=True, slots=True)
class Window:
    """Sliding-window smoother: window length and iteration limits."""

    readings: int
    steps: int
    iterations: int
    convergence_sigmas: float

    def predict(self, model: StateSpace, belief: Belief, joints: JointState) -> WindowedBelief:
        """EKF time update; a window with its maximum number of steps is restarted."""
        windowed, predicted = as_windowed(belief), predict(model, belief, joints)
        if len(windowed.path) >= self.steps:
            windowed = as_windowed(Belief(belief.t_ns, belief.mean, belief.cov))
        path = np.vstack([windowed.path, belief.mean])
        return WindowedBelief(predicted.t_ns, predicted.mean, predicted.cov, windowed.anchor, (*windowed.since, joints), path)

    def update(self, model: StateSpace, belief: Belief, reading: GasReading, gate_nis: float) -> tuple[Belief, Innovation]:
        """Smooth the window with one more reading; when it is full, its oldest reading is absorbed into the anchor."""
        innovation = innovation_of(model, belief, reading, gate_nis)
        if innovation.gated:
            return belief, innovation
        windowed = as_windowed(belief)
        since = (*windowed.since, reading)
        forward, path = self._iterated(model, windowed.anchor, since, windowed.path)
        last = forward.beliefs[-1]
        absorbed = self._absorbed(since)
        anchor = forward.beliefs[absorbed - 1] if absorbed else windowed.anchor
        steps = sum(isinstance(sensed, JointState) for sensed in since[:absorbed])
        return WindowedBelief(last.t_ns, last.mean, last.cov, anchor, since[absorbed:], path[steps:]), innovation

    def _iterated(self, model: StateSpace, anchor: Belief, since: SensorData, path: Array) -> tuple["ForwardPass", Array]:
        """Last forward pass and smoothed states (k, N). Gauss-Newton may diverge: a pass with a larger change than the last is undone."""
        accepted, change = None, np.inf
        for _ in range(self.iterations):
            trial = forward_pass(model, anchor, since, path)
            smoothed = backward_pass(trial, path)
            previous, change = change, trial.moved(smoothed - path)
            if accepted is not None and change >= previous:
                break
            accepted, path = trial, smoothed
            if change < self.convergence_sigmas:
                break
        assert accepted is not None
        return accepted, path

    def _absorbed(self, since: SensorData) -> int:
        """How many entries of the window the anchor absorbs: those up to the oldest reading, if the window is full."""
        readings = [i for i, sensed in enumerate(since) if isinstance(sensed, GasReading)]
        return readings[0] + 1 if len(readings) >= self.readings else 0


@dataclass(frozen=True, slots=True, eq=False)
class ForwardPass:
    """Forward Kalman filter pass: the belief after every entry, with the step or the (row of H, innovation, gain) that led there."""

    anchor: Belief
    beliefs: list[Belief]
    causes: list[LinearizedStep | tuple[Array, float, Array]]  # (H (N,), y / S, K (N,))

    def before(self, i: int) -> Belief:
        """Return the belief before entry i."""
        return self.beliefs[i - 1] if i else self.anchor

    def moved(self, by: Array) -> float:
        """Return the largest change `by` (k, N) of the states of the steps, in standard deviations."""
        steps = [i for i, cause in enumerate(self.causes) if isinstance(cause, LinearizedStep)]
        ratios = [np.max(np.abs(b) / np.sqrt(np.diag(self.before(i).cov))) for i, b in zip(steps, by, strict=True)]
        return float(max(ratios, default=0.0))


def as_windowed(belief: Belief) -> WindowedBelief:
    """Return the belief with its smoothing window; a plain belief begins an empty one."""
    if isinstance(belief, WindowedBelief):
        return belief
    return WindowedBelief(belief.t_ns, belief.mean, belief.cov, belief, (), np.zeros((0, len(belief.mean))))


def forward_pass(model: StateSpace, anchor: Belief, since: SensorData, path: Array) -> ForwardPass:
    """Run the Kalman filter over a window whose steps are linearised about `path` (k, N)."""
    forward, linearised_at = ForwardPass(anchor, [], []), iter(path)
    for i, sensed in enumerate(since):
        before = forward.before(i)
        if isinstance(sensed, JointState):
            step = LinearizedStep.of(model, next(linearised_at), seconds(sensed.t_ns - before.t_ns), sensed)
            forward.causes.append(step)
            forward.beliefs.append(Belief(sensed.t_ns, *step.forward(before.mean, before.cov)))
            continue
        row, residual, r = scalar_measurement(model, before.mean, before.cov, sensed)
        ph = before.cov @ row
        s = float(row @ ph) + r
        forward.causes.append((row, residual / s, ph / s))
        forward.beliefs.append(Belief(sensed.t_ns, *update(model, before.mean, before.cov, sensed)))
    return forward


def backward_pass(passed: ForwardPass, path: Array) -> Array:
    """Return smoothed states (k, N) before each step: x - P lambda, with the costate lambda propagated back by F' and by every reading."""
    smoothed, costate, k = np.empty_like(path), np.zeros(path.shape[1]), len(path)
    for i in reversed(range(len(passed.causes))):
        cause, before = passed.causes[i], passed.before(i)
        if isinstance(cause, LinearizedStep):
            costate, k = cause.back(costate), k - 1
            smoothed[k] = before.mean - before.cov @ costate
        else:
            row, scaled_innovation, gain = cause
            costate = costate - row * (scaled_innovation + float(gain @ costate))
    return smoothed
