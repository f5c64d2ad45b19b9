"""Recorder of one search move: sensor data go to the odometry, the bout detector and the whiff detector, and a `Move` is returned."""

from collections.abc import Callable

import numpy as np

from oio.core.records import Array, GasReading, Innovation, JointState
from oio.estimators.odometry import Odometry
from oio.gas.detection import WhiffDetector
from oio.gas.detection_rule import Detector
from oio.search.view import Move


class MoveRecorder:
    """Passes sensor data to all three in the order of time. Missed readings reach the odometry alone, which does not count them."""

    def __init__(
        self, odometry: Odometry, bouts: Detector, whiffs: WhiffDetector, whiff_sigmas: float, believed: Callable[[], None]
    ) -> None:  # fmt: skip
        self._odometry, self._bouts, self._whiffs, self._whiff_sigmas = odometry, bouts, whiffs, whiff_sigmas
        self._believed = believed  # told of every belief, before anything else is done
        self._bout_flags = [0]

    def begin(self) -> None:
        """Start a move."""
        self._bout_flags = [0]
        self._whiffs.begin()

    def joints(self, state: JointState) -> None:
        """Process the current joint state."""
        self._odometry.joints(state)
        self._whiffs.feed(state)

    def reading(self, reading: GasReading) -> Innovation | None:
        """Process one reading; returns its innovation, None before the first map."""
        innovation = self._odometry.reading(reading)
        if innovation is not None:
            self._believed()
        if not reading.missed:
            bout = self._bouts.feed(reading)
            if bout is not None:
                self._bout_flags.append(int(bout.fired))
            self._whiffs.feed(reading)
        return innovation

    def finished(self, goal: Array) -> Move:
        """Return the finished move to goal (n,) rad."""
        whiffs, threshold = self._whiffs, self._whiff_sigmas
        whiff_q = whiffs.q if whiffs.fresh > threshold else None
        return Move(goal, float(np.mean(self._bout_flags)), whiffs.ppm, whiff_q, whiffs.level <= threshold, whiffs.element_ppm)
