"""The last few readings smoothed together: Gauss-Newton over a window (Bell 1994), for filters whose transition is what is not linear.

A reading sees the lagged concentration, so it is linear in the state, and to iterate its update alone changes nothing. What is not linear
is how the gas follows the nose between readings. So the steps since an anchor are linearised anew about the smoothed states: a forward
pass of the filter, a backward pass of costates (modified Bryson-Frazier, Bierman 1973: no covariance is inverted), again until it settles.
"""

from dataclasses import dataclass

import numpy as np

from oio.core.records import Array, Belief, GasReading, Innovation, JointState, seconds
from oio.estimators.joseph_update import innovation_of, scalar_measurement, update
from oio.estimators.propagation import LinearizedStep, predict
from oio.inference.state_space import StateSpace

Sensed = tuple[JointState | GasReading, ...]


@dataclass(frozen=True, slots=True, eq=False)
class WindowedBelief(Belief):
    """A belief that remembers the window that it came of: where the window begins, what was sensed since, and the states (k, N) about
    which its k steps are linearised."""

    anchor: Belief
    since: Sensed
    path: Array


@dataclass(frozen=True, slots=True)
class Window:
    """How long a window is, and how often it is gone through."""

    readings: int
    steps: int
    iterations: int
    settled_sigmas: float

    def predict(self, model: StateSpace, belief: Belief, joints: JointState) -> WindowedBelief:
        """The prediction of the extended Kalman filter; a window that is full of steps is begun anew."""
        begun, after = as_windowed(belief), predict(model, belief, joints)
        if len(begun.path) >= self.steps:
            begun = as_windowed(Belief(belief.t_ns, belief.mean, belief.cov))
        path = np.vstack([begun.path, belief.mean])
        return WindowedBelief(after.t_ns, after.mean, after.cov, begun.anchor, (*begun.since, joints), path)

    def update(self, model: StateSpace, belief: Belief, reading: GasReading, gate_nis: float) -> tuple[Belief, Innovation]:
        """Smooth the window with one more reading; when it holds enough of them, the oldest goes into the anchor."""
        innovation = innovation_of(model, belief, reading, gate_nis)
        if innovation.gated:
            return belief, innovation
        begun = as_windowed(belief)
        since = (*begun.since, reading)
        passed, path = self._gone_through(model, begun.anchor, since, begun.path)
        last = passed.beliefs[-1]
        cut = self._cut(since)
        anchor = passed.beliefs[cut - 1] if cut else begun.anchor
        steps = sum(isinstance(sensed, JointState) for sensed in since[:cut])
        return WindowedBelief(last.t_ns, last.mean, last.cov, anchor, since[cut:], path[steps:]), innovation

    def _gone_through(self, model: StateSpace, anchor: Belief, since: Sensed, path: Array) -> tuple["ForwardPass", Array]:
        """The last pass and the smoothed states (k, N). Gauss-Newton may run away: a pass that goes farther than the last one is undone."""
        passed, moved = None, np.inf
        for _ in range(self.iterations):
            tried = forward_pass(model, anchor, since, path)
            smoothed = backward_pass(tried, path)
            before, moved = moved, tried.moved(smoothed - path)
            if passed is not None and moved >= before:
                break
            passed, path = tried, smoothed
            if moved < self.settled_sigmas:
                break
        assert passed is not None
        return passed, path

    def _cut(self, since: Sensed) -> int:
        """How much of the window the anchor absorbs: up to the oldest reading, if there are enough."""
        readings = [i for i, sensed in enumerate(since) if isinstance(sensed, GasReading)]
        return readings[0] + 1 if len(readings) >= self.readings else 0


@dataclass(frozen=True, slots=True, eq=False)
class ForwardPass:
    """A forward pass: the belief after everything sensed, with the step or the row of H, innovation and gain that led there."""

    anchor: Belief
    beliefs: list[Belief]
    causes: list[LinearizedStep | tuple[Array, float, Array]]  # (H (N,), y / S, K (N,))

    def before(self, i: int) -> Belief:
        """The belief before what was sensed as number i."""
        return self.beliefs[i - 1] if i else self.anchor

    def moved(self, by: Array) -> float:
        """How far the states of the steps went (k, N), in standard deviations, at most."""
        steps = [i for i, cause in enumerate(self.causes) if isinstance(cause, LinearizedStep)]
        ratios = [np.max(np.abs(b) / np.sqrt(np.diag(self.before(i).cov))) for i, b in zip(steps, by, strict=True)]
        return float(max(ratios, default=0.0))


def as_windowed(belief: Belief) -> WindowedBelief:
    """The belief with its window; one that has none begins one."""
    if isinstance(belief, WindowedBelief):
        return belief
    return WindowedBelief(belief.t_ns, belief.mean, belief.cov, belief, (), np.zeros((0, len(belief.mean))))


def forward_pass(model: StateSpace, anchor: Belief, since: Sensed, path: Array) -> ForwardPass:
    """The Kalman filter over a window whose steps are linearised about `path` (k, N)."""
    passed, linearised_at = ForwardPass(anchor, [], []), iter(path)
    for i, sensed in enumerate(since):
        before = passed.before(i)
        if isinstance(sensed, JointState):
            step = LinearizedStep.of(model, next(linearised_at), seconds(sensed.t_ns - before.t_ns), sensed)
            passed.causes.append(step)
            passed.beliefs.append(Belief(sensed.t_ns, *step.forward(before.mean, before.cov)))
            continue
        row, residual, r = scalar_measurement(model, before.mean, before.cov, sensed)
        to = before.cov @ row
        s = float(row @ to) + r
        passed.causes.append((row, residual / s, to / s))
        passed.beliefs.append(Belief(sensed.t_ns, *update(model, before.mean, before.cov, sensed)))
    return passed


def backward_pass(passed: ForwardPass, path: Array) -> Array:
    """Smoothed states (k, N) before each step: x - P lambda, the costate lambda carried back by F' and by every reading."""
    smoothed, costate, k = np.empty_like(path), np.zeros(path.shape[1]), len(path)
    for i in reversed(range(len(passed.causes))):
        cause, before = passed.causes[i], passed.before(i)
        if isinstance(cause, LinearizedStep):
            costate, k = cause.back(costate), k - 1
            smoothed[k] = before.mean - before.cov @ costate
        else:
            row, pull, gain = cause
            costate = costate - row * (pull + float(gain @ costate))
    return smoothed
