"""Period statistics of a cyclic event."""

import math

from oio.core.records import seconds


class Jitter:
    """Running mean, standard deviation and maximum of the period of a cyclic event (Welford 1962)."""

    def __init__(self) -> None:
        self._last_ns: int | None = None
        self.n, self._mean_s, self._sum2, self.longest_s = 0, 0.0, 0.0, 0.0

    def beat(self, t_ns: int) -> None:
        """Record an event at t_ns."""
        if self._last_ns is not None:
            period_s = seconds(t_ns - self._last_ns)
            self.n += 1
            step = period_s - self._mean_s
            self._mean_s += step / self.n
            self._sum2 += step * (period_s - self._mean_s)
            self.longest_s = max(self.longest_s, period_s)
        self._last_ns = t_ns

    @property
    def hz(self) -> float:
        """Mean rate [Hz]; NaN before the second event."""
        return 1.0 / self._mean_s if self.n and self._mean_s > 0 else math.nan

    @property
    def jitter_s(self) -> float:
        """Standard deviation of the period [s]; NaN before the third event."""
        return math.sqrt(self._sum2 / (self.n - 1)) if self.n > 1 else math.nan

    def __str__(self) -> str:
        return f"{self.hz:.1f} Hz, jitter {1e3 * self.jitter_s:.2f} ms, longest {1e3 * self.longest_s:.1f} ms"
