"""What a move smelt: gas that was there, not what an earlier sniff left in the sensor."""

import math

from oio.calibration import Baseline
from oio.records import GasReading, seconds


class Whiff:
    """Feeds on the readings of one move. A sensor that smells nothing falls from where the move began by exp(-t / fall_s) at least."""

    def __init__(self, baselines: tuple[Baseline, ...], fall_s: float) -> None:
        self._baselines, self._fall_s = baselines, fall_s
        self._first: dict[int, tuple[float, float]] = {}  # per element: when, and the signal [ppm]
        self._last: dict[int, float] = {}
        self.peak = 0.0  # highest signal above what was left, in standard deviations of a reading

    def feed(self, reading: GasReading) -> None:
        """One reading, not a missed one."""
        t_s, signal = seconds(reading.t_ns), reading.ppm - self._baselines[reading.element].ppm
        began_s, first = self._first.setdefault(reading.element, (t_s, signal))
        self._last[reading.element] = signal
        left = max(first, 0.0) * math.exp(-(t_s - began_s) / self._fall_s)
        self.peak = max(self.peak, (signal - left) / reading.sigma_ppm)

    @property
    def ppm(self) -> float:
        """Mean over the elements of their last signal; 0 before the first reading."""
        return sum(self._last.values()) / len(self._last) if self._last else 0.0
