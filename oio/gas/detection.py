"""Whiff detection: gas met during a move, as opposed to the decaying sensor response to earlier gas."""

import math

from oio.core.records import Array, GasReading, JointState, seconds
from oio.gas.bouts import ElementBaseline


class WhiffDetector:
    """Whiff detector, fed with joints and readings over all moves. In clean air a signal decays by exp(-t / fall_s)."""

    def __init__(self, baselines: tuple[ElementBaseline, ...], fall_s: float) -> None:
        self._baselines, self._fall_s = baselines, fall_s
        self._latest: dict[int, tuple[float, float]] = {}  # per element: time [s] and signal [ppm]
        self._joints: JointState | None = None
        self.begin()

    def begin(self) -> None:
        """Begin a move. `fresh` and `level`: its highest signal above the decayed earlier one, and above clean air, in standard
        deviations of a reading; `q`: the joints (n,) [rad] where the signal rose most."""
        self._at_move_start = dict(self._latest)
        self.fresh = self.level = self._largest_rise = 0.0
        self.q: Array | None = None

    def feed(self, sensed: JointState | GasReading) -> None:
        """Process joints, or a valid (not missed) reading."""
        if isinstance(sensed, JointState):
            self._joints = sensed
            return
        t_s, signal = seconds(sensed.t_ns), sensed.ppm - self._baselines[sensed.element].ppm
        now = t_s, signal
        self.fresh = max(self.fresh, (signal - self._decayed(self._at_move_start.setdefault(sensed.element, now), t_s)) / sensed.sigma_ppm)
        self.level = max(self.level, signal / sensed.sigma_ppm)
        rise = (signal - self._decayed(self._latest.get(sensed.element, now), t_s)) / sensed.sigma_ppm
        if rise > self._largest_rise and self._joints is not None:
            self._largest_rise, self.q = rise, self._joints.q
        self._latest[sensed.element] = now

    def _decayed(self, earlier: tuple[float, float], t_s: float) -> float:
        return max(earlier[1], 0.0) * math.exp(-(t_s - earlier[0]) / self._fall_s)

    @property
    def element_ppm(self) -> tuple[float, ...]:
        """Latest signal of each element above its baseline [ppm]; empty until every element was read."""
        latest = self._latest
        return tuple(latest[e][1] for e in sorted(latest)) if len(latest) == len(self._baselines) else ()

    @property
    def ppm(self) -> float:
        """Mean over the elements of their latest signal above baseline [ppm]; 0 before the first reading."""
        return sum(signal for _, signal in self._latest.values()) / len(self._latest) if self._latest else 0.0
