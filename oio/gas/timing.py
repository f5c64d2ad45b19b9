"""Time delay of gas stamps: a reading stamped t was taken at t - d (latency of USB frames, serial buffers); joints are stamped when read.

The clock of the gas stamps is the common one: joints of t - d get the stamp t, so that no reading is restamped and the log stays in order.
Encoder drift within d is neglected (at 90 s a hundredth of a degree in 0.1 s).

Only fast changes separate the delay from the sensor's lag: both shift a slow signal, by d + tau in total. Where the readings do not
separate them, their priors decide, and the sum, which the search needs, is estimated nevertheless.
"""

from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from oio.core.records import Array, GasReading, JointState, nanoseconds
from oio.gas.trace import Sniffs


@dataclass(frozen=True, slots=True)
class Delay:
    """Time delay of the gas stamps [s] and its standard uncertainty [s]; 0 if the delay is taken as known."""

    s: float
    u_s: float


def shift_path(sniffs: Sniffs, delay_s: float, first_s: float = 0.0) -> Sniffs:
    """Return the same readings on a path that is `delay_s` later, with nodes at the readings. Readings before this path, or before the
    start of the path shifted by `first_s`, are dropped."""
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
    """Delay line for joint states on the way to the filter: held back by the delay and restamped to the clock of the gas."""

    def __init__(self, delay_s: float) -> None:
        self._delay_ns, self._waiting = nanoseconds(delay_s), deque[JointState]()
        self._last: JointState | None = None

    def joints(self, state: JointState) -> list[JointState]:
        """Add joint states and return those now due: at once if the delay is 0."""
        self._waiting.append(replace(state, t_ns=state.t_ns + self._delay_ns) if self._delay_ns else state)
        return self._pop_due(state.t_ns)

    def reading(self, reading: GasReading) -> list[JointState]:
        """Return the joint states due before this reading; the last is interpolated at its time."""
        due = self._pop_due(reading.t_ns)
        if self._last is None or not self._waiting or self._last.t_ns == reading.t_ns:
            return due
        self._last = _interpolated(self._last, self._waiting[0], reading.t_ns)
        return [*due, self._last]

    def _pop_due(self, t_ns: int) -> list[JointState]:
        due = []
        while self._waiting and self._waiting[0].t_ns <= t_ns:
            due.append(self._waiting.popleft())
        self._last = due[-1] if due else self._last
        return due


def _interpolated(a: JointState, b: JointState, t_ns: int) -> JointState:
    fraction = (t_ns - a.t_ns) / (b.t_ns - a.t_ns)

    def interpolate(x: Array, y: Array) -> Array:
        return np.asarray(x + fraction * (y - x))

    return JointState(t_ns, interpolate(a.q, b.q), interpolate(a.dq, b.dq), interpolate(a.ddq, b.ddq))
