"""One step of a belief in time: what all filters share, on top of the compiled kernels."""

from dataclasses import dataclass

import numpy as np

from oio.core.records import Array, Belief, JointState, seconds
from oio.estimators import propagation_kernel
from oio.inference.state_space import StateSpace


def predict(model: StateSpace, belief: Belief, joints: JointState) -> Belief:
    """The extended Kalman filter's prediction at the time of `joints`: x = f(x), P = F P F' + Q."""
    _check_size(model, belief.mean, joints)
    dt_s = seconds(joints.t_ns - belief.t_ns)
    mean, cov = propagation_kernel.predict(belief.mean, belief.cov, dt_s, joints.q, joints.dq, model.arm.chain, *model.constants)
    return Belief(joints.t_ns, mean, cov)


def propagate_mean(model: StateSpace, x: Array, dt_s: float, joints: JointState) -> Array:
    """f(x) (k, N) of many states x (k, N)."""
    _check_size(model, x[0], joints)
    new, _, _ = propagation_kernel.propagate(x, dt_s, joints.q, joints.dq, model.arm.chain, model.constants.gas)
    return np.asarray(new)


@dataclass(frozen=True, slots=True, eq=False)
class LinearizedStep:
    """A step linearised at a state: x_next = mean + F (x - at) + w, w ~ (0, Q)."""

    model: StateSpace
    at: Array  # (N,)
    mean: Array  # f(at) (N,)
    row: Array  # F's row of f (N,)
    lag: Array  # what `coupled` says of the step (6,)
    dt_s: float

    @staticmethod
    def of(model: StateSpace, at: Array, dt_s: float, joints: JointState) -> "LinearizedStep":
        """The step of dt_s that ends with the encoders at `joints`."""
        _check_size(model, at, joints)
        mean, row, lag = propagation_kernel.propagate(at[None, :], dt_s, joints.q, joints.dq, model.arm.chain, model.constants.gas)
        return LinearizedStep(model, at, mean[0], row[0], lag[0], dt_s)

    def forward(self, mean: Array, cov: Array) -> tuple[Array, Array]:
        """A Gaussian (N,), (N, N) one step later: mean + F (x - at), F P F' + Q."""
        n, (_, walk, drift) = self.model.arm.dof, self.model.constants
        away = propagation_kernel.apply_transition((mean - self.at)[:, None], self.row, self.lag[2], self.dt_s, n)[:, 0]
        return self.mean + away, propagation_kernel.propagate_covariance(cov, self.row, self.lag, self.dt_s, n, walk, drift)

    def back(self, costate: Array) -> Array:
        """F' lambda (N,)."""
        return np.asarray(propagation_kernel.apply_transition_transposed(costate, self.row, self.lag[2], self.dt_s, self.model.arm.dof))


def add_process_noise(model: StateSpace, x: Array, cov: Array, dt_s: float, joints: JointState) -> Array:
    """P + Q (N, N), Q that of a step from x (N,)."""
    _, _, lag = propagation_kernel.propagate(x[None, :], dt_s, joints.q, joints.dq, model.arm.chain, model.constants.gas)
    return np.asarray(propagation_kernel.add_process_noise(cov, lag[0], dt_s, model.arm.dof, *model.constants[1:]))


def _check_size(model: StateSpace, x: Array, joints: JointState) -> None:
    """Compiled code looks at no bounds."""
    if x.shape != (model.size,) or joints.q.shape != (model.arm.dof,) or joints.dq.shape != (model.arm.dof,):
        raise ValueError(f"expected {model.size} states and {model.arm.dof} joint values, got {x.shape} and {joints.q.shape}")
