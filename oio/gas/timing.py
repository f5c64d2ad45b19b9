"""Gas that is stamped late: a reading stamped t was taken at t - d (USB frames, serial buffers); joints are stamped when they were read.

Everything is told in the time of the gas: joints of t - d carry the stamp t, so that no reading has to be restamped and the log stays in
order. What the encoders drift within d is left out (at 90 s a hundredth of a degree in 0.1 s).

The delay and the sensor's lag are told apart by fast changes only: both shift a slow signal, by d + tau in all. Where the readings cannot
tell, the priors of both decide, and the sum, which is what the search needs, is found nevertheless.
"""

from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from oio.core.records import Array, GasReading, JointState, nanoseconds
from oio.gas.trace import Sniffs


@dataclass(frozen=True, slots=True)
class Delay:
    """How late readings are stamped [s], and its standard uncertainty; 0 if it is taken as known."""

    s: float
    u_s: float


def shift_path(sniffs: Sniffs, delay_s: float, first_s: float = 0.0) -> Sniffs:
    """The same readings, on a path that is `delay_s` later, with nodes at the readings. Those before the path, or before its beginning
    shifted by `first_s`, are left out."""
    if delay_s == 0.0 and first_s == 0.0:
        return sniffs
    t = sniffs.t_s + delay_s
    kept = sniffs.reading_t_s >= sniffs.t_s[0] + max(delay_s, first_s)
    times = sniffs.reading_t_s[kept]
    nodes = np.union1d(t[(t > times[0]) & (t <= times[-1])], times)
    q = np.stack([np.interp(nodes, t, joint) for joint in sniffs.q.T], axis=1)
    return Sniffs(
        nodes, q, np.searchsorted(nodes, times), times,
        sniffs.element[kept], sniffs.ppm[kept], sniffs.sigma_ppm[kept], sniffs.censored[kept],
    )  # fmt: skip


class JointDelayLine:
    """Joints on their way to the filter: held back for the delay, and stamped with the gas's time."""

    def __init__(self, delay_s: float) -> None:
        self._delay_ns, self._waiting = nanoseconds(delay_s), deque[JointState]()
        self._last: JointState | None = None

    def joints(self, state: JointState) -> list[JointState]:
        """What is due when these arrive: at once if nothing is late."""
        self._waiting.append(replace(state, t_ns=state.t_ns + self._delay_ns) if self._delay_ns else state)
        return self._until(state.t_ns)

    def reading(self, reading: GasReading) -> list[JointState]:
        """What is due before this reading; the last of it are the joints at its time, between those before and after."""
        due = self._until(reading.t_ns)
        if self._last is None or not self._waiting or self._last.t_ns == reading.t_ns:
            return due
        self._last = _interpolated(self._last, self._waiting[0], reading.t_ns)
        return [*due, self._last]

    def _until(self, t_ns: int) -> list[JointState]:
        due = []
        while self._waiting and self._waiting[0].t_ns <= t_ns:
            due.append(self._waiting.popleft())
        self._last = due[-1] if due else self._last
        return due


def _interpolated(a: JointState, b: JointState, t_ns: int) -> JointState:
    share = (t_ns - a.t_ns) / (b.t_ns - a.t_ns)

    def mixed(x: Array, y: Array) -> Array:
        return np.asarray(x + share * (y - x))

    return JointState(t_ns, mixed(a.q, b.q), mixed(a.dq, b.dq), mixed(a.ddq, b.ddq))
