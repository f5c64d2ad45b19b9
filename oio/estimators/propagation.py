"""Time update of a belief, shared by all filters: the interface to the compiled kernels."""

from dataclasses import dataclass

import numpy as np

from oio.core.records import Array, Belief, JointState, seconds
from oio.estimators import propagation_kernel
from oio.inference.state_space import StateSpace


def predict(model: StateSpace, belief: Belief, joints: JointState) -> Belief:
    """EKF time update to the time of `joints`: x = f(x), P = F P F' + Q."""
    _check_size(model, belief.mean, joints)
    dt_s = seconds(joints.t_ns - belief.t_ns)
    mean, cov = propagation_kernel.predict(belief.mean, belief.cov, dt_s, joints.q, joints.dq, model.arm.chain, *model.constants)
    return Belief(joints.t_ns, mean, cov)


def propagate_mean(model: StateSpace, x: Array, dt_s: float, joints: JointState) -> Array:
    """Return f(x) (k, N) for many states x (k, N), such as sigma points."""
    _check_size(model, x[0], joints)
    new, _, _ = propagation_kernel.propagate(x, dt_s, joints.q, joints.dq, model.arm.chain, model.constants.gas)
    return np.asarray(new)


@dataclass(frozen=True, slots=True, eq=False)
class LinearizedStep:
    """Transition linearised at a state `at`: x_next = mean + F (x - at) + w, w ~ (0, Q)."""

    model: StateSpace
    at: Array  # (N,)
    mean: Array  # f(at) (N,)
    rows: Array  # rows of F for the lagged concentrations f (P, N)
    lag: Array  # lag and fluctuation terms of the step, see `oio.estimators.propagation_kernel`
    dt_s: float

    @staticmethod
    def of(model: StateSpace, at: Array, dt_s: float, joints: JointState) -> "LinearizedStep":
        """Linearise the step of dt_s that ends with the encoders at `joints`."""
        _check_size(model, at, joints)
        mean, rows, lag = propagation_kernel.propagate(at[None, :], dt_s, joints.q, joints.dq, model.arm.chain, model.constants.gas)
        return LinearizedStep(model, at, mean[0], rows[0], lag[0], dt_s)

    def forward(self, mean: Array, cov: Array) -> tuple[Array, Array]:
        """Propagate a Gaussian (N,), (N, N) by one step: mean + F (x - at), F P F' + Q."""
        n, (_, walk, drift) = self.model.arm.dof, self.model.constants
        deviation = propagation_kernel.apply_transition((mean - self.at)[:, None], self.rows, self.lag, self.dt_s, n)[:, 0]
        return self.mean + deviation, propagation_kernel.propagate_covariance(cov, self.rows, self.lag, self.dt_s, n, walk, drift)

    def back(self, costate: Array) -> Array:
        """Return F' lambda (N,), the costate one step earlier."""
        return np.asarray(propagation_kernel.apply_transition_transposed(costate, self.rows, self.lag, self.dt_s, self.model.arm.dof))


def add_process_noise(model: StateSpace, x: Array, cov: Array, dt_s: float, joints: JointState) -> Array:
    """Return P + Q (N, N), with the process noise Q of a step from state x (N,)."""
    _, _, lag = propagation_kernel.propagate(x[None, :], dt_s, joints.q, joints.dq, model.arm.chain, model.constants.gas)
    return np.asarray(propagation_kernel.add_process_noise(cov, lag[0], dt_s, model.arm.dof, *model.constants[1:]))


def _check_size(model: StateSpace, x: Array, joints: JointState) -> None:
    """Raise ValueError for wrong sizes: compiled code does not check bounds."""
    if x.shape != (model.size,) or joints.q.shape != (model.arm.dof,) or joints.dq.shape != (model.arm.dof,):
        raise ValueError(f"expected {model.size} states and {model.arm.dof} joint values, got {x.shape} and {joints.q.shape}")
