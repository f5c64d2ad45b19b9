"""The last readings of one element, thinned to one mean per step of time, and their sparkline."""

from collections import deque

from oio.core.records import SECOND_NS, GasReading

STEP_NS, STEPS = 2 * SECOND_NS, 30  # a minute of the world
BLOCKS = "▁▂▃▄▅▆▇█"


class SignalHistory:
    """Means of readings over steps of STEP_NS, the last STEPS of them."""

    def __init__(self) -> None:
        self._sums: deque[tuple[int, float, int]] = deque(maxlen=STEPS)  # step, sum [ppm], count
        self.latest_ppm = 0.0

    def add(self, reading: GasReading) -> None:
        """Take up a reading; one that was missed is left out."""
        if reading.missed:
            return
        step, self.latest_ppm = reading.t_ns // STEP_NS, reading.ppm
        if self._sums and self._sums[-1][0] == step:
            _, total, count = self._sums.pop()
            self._sums.append((step, total + reading.ppm, count + 1))
        else:
            self._sums.append((step, reading.ppm, 1))

    @property
    def means_ppm(self) -> list[float]:
        """One mean per step that had readings, oldest first [ppm]."""
        return [total / count for _, total, count in self._sums]

    def sparkline(self) -> str:
        """A block per mean, between the least and the greatest of them."""
        means = self.means_ppm
        if not means:
            return ""
        low, high = min(means), max(means)
        span = (high - low) or 1.0
        return "".join(BLOCKS[round((mean - low) / span * (len(BLOCKS) - 1))] for mean in means)
