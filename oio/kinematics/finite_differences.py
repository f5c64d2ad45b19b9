"""Joint velocity and acceleration by finite differences of angles: the sources disagree on the unit of the velocity that a bus reports."""

import numpy as np

from oio.core.records import Array, JointState, seconds


class FiniteDifferences:
    """Backward differences of a sequence of joint angles."""

    def __init__(self) -> None:
        self._previous: JointState | None = None

    def state(self, t_ns: int, q_rad: Array) -> JointState:
        """Return the joint state at t_ns: q (n,) rad, dq (n,) rad/s and ddq (n,) rad/s^2 since the previous one."""
        previous, zeros = self._previous, np.zeros_like(q_rad)
        if previous is None:
            self._previous = JointState(t_ns, q_rad, zeros, zeros)
        else:
            dt_s = seconds(t_ns - previous.t_ns)
            dq = (q_rad - previous.q) / dt_s
            self._previous = JointState(t_ns, q_rad, dq, (dq - previous.dq) / dt_s)
        return self._previous
