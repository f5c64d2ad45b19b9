"""Velocity and acceleration as differences of angles: what a bus gives for velocity has a unit that sources disagree about."""

import numpy as np

from oio.core.records import Array, JointState, seconds


class FiniteDifferences:
    """One joint state after the other."""

    def __init__(self) -> None:
        self._before: JointState | None = None

    def state(self, t_ns: int, q_rad: Array) -> JointState:
        """Angles q (n,) rad at t_ns, with dq (n,) rad/s and ddq (n,) rad/s^2 since the state before."""
        before, nothing = self._before, np.zeros_like(q_rad)
        if before is None:
            self._before = JointState(t_ns, q_rad, nothing, nothing)
        else:
            dt_s = seconds(t_ns - before.t_ns)
            dq = (q_rad - before.q) / dt_s
            self._before = JointState(t_ns, q_rad, dq, (dq - before.dq) / dt_s)
        return self._before
