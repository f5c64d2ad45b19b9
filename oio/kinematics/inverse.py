"""Inverse kinematics by damped least squares (Wampler 1986, IEEE SMC 16:93), compiled."""

import numpy as np
from numpy.typing import NDArray

from oio.core.compiled import compiled
from oio.core.records import Array
from oio.kinematics.forward import SerialChain, nose_and_jacobian

MAX_STEPS = 60
DAMPING_M2 = 1e-4
MAX_STEP = 0.3  # rad (m) that a joint may go in one step


@compiled
def solve_positions(
    goals: Array, begin: Array, low: Array, high: Array, tolerance: float,
    chain: SerialChain,
) -> tuple[Array, NDArray[np.bool_]]:  # fmt: skip
    """Joints (k, n) that bring the nose within `tolerance` m of goals (k, 3), each begun from its row of `begin` (k, n), and whether
    they do (k,). The chain is that of `nose_and_jacobian`; joints stay within low, high (n,)."""
    q_all, there = begin.copy(), np.zeros(len(goals), dtype=np.bool_)
    for i in range(len(goals)):
        q = q_all[i : i + 1]
        for _ in range(MAX_STEPS):
            p, jacobians = nose_and_jacobian(q, chain, bool(1))  # True is a type of its own: all would be compiled for it once more
            miss, jacobian = goals[i] - p[0], jacobians[0]
            if miss @ miss < tolerance * tolerance:
                there[i] = True
                break
            normal = jacobian @ jacobian.T + DAMPING_M2 * np.eye(3)
            step = jacobian.T @ np.linalg.solve(normal, miss)
            for j in range(q.shape[1]):
                q[0, j] = min(max(q[0, j] + min(max(step[j], -MAX_STEP), MAX_STEP), low[j]), high[j])
    return q_all, there
