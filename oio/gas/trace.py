"""Trace of readings along a joint path, thinned to what a batch fit needs: joints while they move, and every reading."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from oio.core.errors import NotObservable
from oio.core.records import Array, GasReading, JointState, seconds

STILL_RAD = 0.004  # joints that moved less than this since they were last kept are at rest: 2.5 encoder counts


@dataclass(slots=True)
class Trace:
    """Buffer of joints (at most every `period_s`) and all readings; at most `limit` of either, the oldest are dropped first."""

    period_s: float
    limit: int
    _t: list[float] = field(default_factory=list)
    _q: list[Array] = field(default_factory=list)
    _readings: list[GasReading] = field(default_factory=list)
    _joints: JointState | None = None

    def add(self, sensed: JointState | GasReading) -> None:
        """Add joints or a reading."""
        if isinstance(sensed, JointState):
            self.joints(sensed)
        else:
            self.reading(sensed)

    def joints(self, state: JointState) -> None:
        """Add joints; they are kept every `period_s` while they move, ten times less often at rest."""
        self._joints = state
        if not self._t:
            self._keep(state)
            return
        elapsed_s = seconds(state.t_ns) - self._t[-1]
        if elapsed_s < self.period_s - 1e-9:
            return
        if elapsed_s >= 10.0 * self.period_s - 1e-9 or np.abs(state.q - self._q[-1]).max() > STILL_RAD:
            self._keep(state)

    def reading(self, reading: GasReading) -> None:
        """Add a reading, and the joints at its time; a reading before the first joints is dropped."""
        if self._joints is None:
            return
        if seconds(self._joints.t_ns) > self._t[-1]:
            self._keep(self._joints)
        self._readings.append(reading)
        if len(self._readings) > self.limit:
            del self._readings[: self.limit // 10]

    def _keep(self, state: JointState) -> None:
        self._t.append(seconds(state.t_ns))
        self._q.append(state.q)
        if len(self._t) > self.limit:
            del self._t[: self.limit // 10], self._q[: self.limit // 10]

    def __len__(self) -> int:
        return len(self._readings)

    @property
    def readings(self) -> tuple[GasReading, ...]:
        """The readings that are kept, in order of time."""
        return tuple(self._readings)

    def take_out(self, wrong: NDArray[np.bool_]) -> None:
        """Forget some of the readings, those of a mask (m,)."""
        self._readings = [reading for reading, out in zip(self._readings, wrong.tolist(), strict=True) if not out]

    def as_arrays(self) -> "Sniffs":
        """Return the trace as arrays; raises NotObservable if it has fewer than two readings."""
        t = np.array(self._t)
        kept = [r for r in self._readings if seconds(r.t_ns) >= t[0]]
        if len(kept) < 2:
            raise NotObservable("the trace has fewer than two readings; sniff longer before a map is made.")
        times = np.array([seconds(r.t_ns) for r in kept])
        whole = Sniffs(
            t_s=t,
            q=np.array(self._q),
            at=np.searchsorted(t, times + 1e-9) - 1,
            reading_t_s=times,
            element=np.array([r.element for r in kept], dtype=np.int64),
            ppm=np.array([r.ppm for r in kept]),
            sigma_ppm=np.array([r.sigma_ppm for r in kept]),
            censored=np.array([r.censored for r in kept], dtype=np.bool_),
        )
        return whole.between(float(times[0]), np.inf)


@dataclass(frozen=True, slots=True, eq=False)
class Sniffs:
    """Joint path t_s (k,) [s], q (k, n) [rad] and readings on it: path index, time, element, ppm, sigma_ppm, censored, each (m,).

    The path begins at the first reading, which initialises the sensor's lag: earlier gas has no other effect.
    """

    t_s: Array
    q: Array
    at: NDArray[np.int64]
    reading_t_s: Array
    element: NDArray[np.int64]
    ppm: Array
    sigma_ppm: Array
    censored: NDArray[np.bool_]

    def between(self, begin_s: float, end_s: float) -> "Sniffs":
        """Return the part with begin_s <= t <= end_s, from its first reading on; raises NotObservable if it has none."""
        kept = (self.reading_t_s >= begin_s) & (self.reading_t_s <= end_s)
        if not np.any(kept):
            raise NotObservable(f"there is no reading from {begin_s:.3f} to {end_s:.3f} s; sniff longer, until the sensor has been read.")
        first = int(self.at[kept][0])
        path = slice(first, int(np.searchsorted(self.t_s, end_s, side="right")))
        return Sniffs(
            self.t_s[path], self.q[path], self.at[kept] - first, self.reading_t_s[kept],
            self.element[kept], self.ppm[kept], self.sigma_ppm[kept], self.censored[kept],
        )  # fmt: skip

    def without(self, begin_s: float, end_s: float) -> "Sniffs":
        """Return the same path without the readings of begin_s <= t <= end_s; the first reading is always kept."""
        return self.only((self.reading_t_s < begin_s) | (self.reading_t_s > end_s))

    def only(self, kept: NDArray[np.bool_]) -> "Sniffs":
        """Return the same path with some of the readings, `kept` (m,); the first is always kept, because it initialises the lag."""
        kept = kept | (np.arange(len(kept)) == 0)
        return Sniffs(
            self.t_s, self.q, self.at[kept], self.reading_t_s[kept],
            self.element[kept], self.ppm[kept], self.sigma_ppm[kept], self.censored[kept],
        )  # fmt: skip
