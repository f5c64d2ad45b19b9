"""One step of a belief in time: what all filters share, on top of the compiled kernels."""

from dataclasses import dataclass

import numpy as np

from oio.core.records import Array, Belief, JointState, seconds
from oio.estimators import propagation_kernel
from oio.inference.state_space import Model


def predicted(model: Model, belief: Belief, joints: JointState) -> Belief:
    """The extended Kalman filter's prediction at the time of `joints`: x = f(x), P = F P F' + Q."""
    _same_size(model, belief.mean, joints)
    dt_s = seconds(joints.t_ns - belief.t_ns)
    mean, cov = propagation_kernel.predicted(belief.mean, belief.cov, dt_s, joints.q, joints.dq, model.arm.links, *model.constants)
    return Belief(joints.t_ns, mean, cov)


def moved(model: Model, x: Array, dt_s: float, joints: JointState) -> Array:
    """f(x) (k, N) of many states x (k, N)."""
    _same_size(model, x[0], joints)
    new, _, _ = propagation_kernel.moved(x, dt_s, joints.q, joints.dq, model.arm.links, model.constants[0])
    return np.asarray(new)


@dataclass(frozen=True, slots=True, eq=False)
class Linear:
    """A step linearised at a state: x_next = mean + F (x - at) + w, w ~ (0, Q)."""

    model: Model
    at: Array  # (N,)
    mean: Array  # f(at) (N,)
    row: Array  # F's row of f (N,)
    lag: Array  # what `coupled` says of the step (6,)
    dt_s: float

    @staticmethod
    def of(model: Model, at: Array, dt_s: float, joints: JointState) -> "Linear":
        """The step of dt_s that ends with the encoders at `joints`."""
        _same_size(model, at, joints)
        mean, row, lag = propagation_kernel.moved(at[None, :], dt_s, joints.q, joints.dq, model.arm.links, model.constants[0])
        return Linear(model, at, mean[0], row[0], lag[0], dt_s)

    def forward(self, mean: Array, cov: Array) -> tuple[Array, Array]:
        """A Gaussian (N,), (N, N) one step later: mean + F (x - at), F P F' + Q."""
        n, (_, walk, drift) = self.model.arm.dof, self.model.constants
        away = propagation_kernel.through((mean - self.at)[:, None], self.row, self.lag[2], self.dt_s, n)[:, 0]
        return self.mean + away, propagation_kernel.carried(cov, self.row, self.lag, self.dt_s, n, walk, drift)

    def back(self, costate: Array) -> Array:
        """F' lambda (N,)."""
        return np.asarray(propagation_kernel.back(costate, self.row, self.lag[2], self.dt_s, self.model.arm.dof))


def noisy(model: Model, x: Array, cov: Array, dt_s: float, joints: JointState) -> Array:
    """P + Q (N, N), Q that of a step from x (N,)."""
    _, _, lag = propagation_kernel.moved(x[None, :], dt_s, joints.q, joints.dq, model.arm.links, model.constants[0])
    return np.asarray(propagation_kernel.noisy(cov, lag[0], dt_s, model.arm.dof, *model.constants[1:]))


def _same_size(model: Model, x: Array, joints: JointState) -> None:
    """Compiled code looks at no bounds."""
    if x.shape != (model.size,) or joints.q.shape != (model.arm.dof,) or joints.dq.shape != (model.arm.dof,):
        raise ValueError(f"expected {model.size} states and {model.arm.dof} joint values, got {x.shape} and {joints.q.shape}")
