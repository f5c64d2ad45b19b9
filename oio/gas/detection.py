"""What a move smelt: gas that was there, not what an earlier sniff left in the sensor."""

import math

from oio.core.records import Array, GasReading, JointState, seconds
from oio.gas.bouts import ElementBaseline


class WhiffDetector:
    """Feeds on what is sensed in move after move. In clean air a sensor falls from where it was by exp(-t / fall_s)."""

    def __init__(self, baselines: tuple[ElementBaseline, ...], fall_s: float) -> None:
        self._baselines, self._fall_s = baselines, fall_s
        self._last: dict[int, tuple[float, float]] = {}  # of each element: when, and the signal [ppm]
        self._joints: JointState | None = None
        self.begin()

    def begin(self) -> None:
        """A move begins. `fresh` and `level`: its highest signal above what was left, and above clean air, in sigmas of a reading;
        `q`: the joints (n,) rad where the signal rose most."""
        self._before = dict(self._last)
        self.fresh = self.level = self._rise = 0.0
        self.q: Array | None = None

    def feed(self, sensed: JointState | GasReading) -> None:
        """Joints, or a reading that is not a missed one."""
        if isinstance(sensed, JointState):
            self._joints = sensed
            return
        t_s, signal = seconds(sensed.t_ns), sensed.ppm - self._baselines[sensed.element].ppm
        now = t_s, signal
        self.fresh = max(self.fresh, (signal - self._left(self._before.setdefault(sensed.element, now), t_s)) / sensed.sigma_ppm)
        self.level = max(self.level, signal / sensed.sigma_ppm)
        rise = (signal - self._left(self._last.get(sensed.element, now), t_s)) / sensed.sigma_ppm
        if rise > self._rise and self._joints is not None:
            self._rise, self.q = rise, self._joints.q
        self._last[sensed.element] = now

    def _left(self, then: tuple[float, float], t_s: float) -> float:
        return max(then[1], 0.0) * math.exp(-(t_s - then[0]) / self._fall_s)

    @property
    def ppm(self) -> float:
        """Mean over the elements of their last signal; 0 before the first reading."""
        return sum(signal for _, signal in self._last.values()) / len(self._last) if self._last else 0.0
