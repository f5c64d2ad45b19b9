"""Gas that is stamped late: a reading stamped t was taken at t - d (USB frames, serial buffers); joints are stamped when they were read.

Everything is told in the time of the gas: joints of t - d carry the stamp t, so that no reading has to be restamped and the log stays in
order. What the encoders drift within d is left out (at 90 s a hundredth of a degree in 0.1 s).

The delay and the sensor's lag are told apart by fast changes only: both shift a slow signal, by d + tau in all. Where the readings cannot
tell, the priors of both decide, and the sum, which is what the search needs, is found nevertheless.
"""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from oio.batch import Fit, solve
from oio.problem import Problem
from oio.records import Array, GasReading, JointState, nanoseconds
from oio.trace import Sniffs

WIDE, GOLDEN_STEPS = 3.0, 12  # standard deviations searched either side; each step narrows them to 0.618: to 1/50 of one
GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
BEND = 0.25  # of the prior's standard deviation: from where to where the curvature is taken


@dataclass(frozen=True, slots=True)
class Delay:
    """How late readings are stamped [s], and its standard uncertainty; 0 if it is taken as known."""

    s: float
    u_s: float


def shifted(sniffs: Sniffs, delay_s: float, first_s: float = 0.0) -> Sniffs:
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


def estimated(problem: Problem, prior: Delay, fit: Callable[[Problem], Fit]) -> Delay:
    """The delay of greatest profile likelihood of a problem on the unshifted path, with its prior; its variance is 2 / (-2 ln L)''.

    `fit` says how gas fluctuates once the delay is nearly right; a wrong delay looks like fluctuation, so it is asked twice.
    """
    most_s, found_s, curve = prior.s + WIDE * prior.u_s, prior.s, 0.0

    def at(delay_s: float) -> Problem:
        return replace(problem, sniffs=shifted(problem.sniffs, delay_s, most_s))  # the same readings whatever the delay

    for _ in range(2):
        begun = fit(at(found_s))

        def cost(delay_s: float, begun: Fit = begun) -> float:
            there = replace(at(delay_s), law=begun.law)
            return solve(there, begun.mean, begun.fluctuation).chi2 + ((delay_s - prior.s) / prior.u_s) ** 2

        found_s = golden(cost, max(prior.s - WIDE * prior.u_s, 0.0), most_s)
        h = BEND * prior.u_s
        low, high = max(found_s - h, 0.0), found_s + h
        below, here, above = cost(low), cost(found_s), cost(high)
        curve = 2.0 * ((above - here) / (high - found_s) - (here - below) / max(found_s - low, 1e-9)) / (high - low)
    return Delay(found_s, min(float(np.sqrt(2.0 / max(curve, 1e-12))), prior.u_s))


def golden(cost: Callable[[float], float], low: float, high: float) -> float:
    """Where a function of one hill is least (golden section; Kiefer 1953)."""
    a, b = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_a, at_b = cost(a), cost(b)
    for _ in range(GOLDEN_STEPS):
        if at_a < at_b:
            high, b, at_b = b, a, at_a
            a = high - GOLDEN * (high - low)
            at_a = cost(a)
        else:
            low, a, at_a = a, b, at_b
            b = low + GOLDEN * (high - low)
            at_b = cost(b)
    return a if at_a < at_b else b


class Held:
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
        self._last = _between(self._last, self._waiting[0], reading.t_ns)
        return [*due, self._last]

    def _until(self, t_ns: int) -> list[JointState]:
        due = []
        while self._waiting and self._waiting[0].t_ns <= t_ns:
            due.append(self._waiting.popleft())
        self._last = due[-1] if due else self._last
        return due


def _between(a: JointState, b: JointState, t_ns: int) -> JointState:
    share = (t_ns - a.t_ns) / (b.t_ns - a.t_ns)

    def mixed(x: Array, y: Array) -> Array:
        return np.asarray(x + share * (y - x))

    return JointState(t_ns, mixed(a.q, b.q), mixed(a.dq, b.dq), mixed(a.ddq, b.ddq))
