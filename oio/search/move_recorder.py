"""One move of a search: everything sensed goes to the odometry, the bout rule and the whiff detector, and a `Move` comes out."""

import numpy as np

from oio.core.records import Array, GasReading, Innovation, JointState
from oio.estimators.odometry import Odometry
from oio.gas.bouts import BoutDetector
from oio.gas.detection import WhiffDetector
from oio.search.view import Move


class MoveRecorder:
    """Feeds all three in the order of time. Missed readings reach the odometry alone, which counts none."""

    def __init__(self, odometry: Odometry, bouts: BoutDetector, whiffs: WhiffDetector, whiff_sigmas: float) -> None:
        self._odometry, self._bouts, self._whiffs, self._whiff_sigmas = odometry, bouts, whiffs, whiff_sigmas
        self._fired = [0]

    def begin(self) -> None:
        """A move begins."""
        self._fired = [0]
        self._whiffs.begin()

    def joints(self, state: JointState) -> None:
        """The arm is here now."""
        self._odometry.joints(state)
        self._whiffs.feed(state)

    def reading(self, reading: GasReading) -> Innovation | None:
        """One reading; its innovation, None before the first map."""
        innovation = self._odometry.reading(reading)
        if not reading.missed:
            bout = self._bouts.feed(reading)
            if bout is not None:
                self._fired.append(int(bout.fired))
            self._whiffs.feed(reading)
        return innovation

    def finished(self, goal: Array) -> Move:
        """The move to goal (n,) rad that has ended."""
        whiffs, limit = self._whiffs, self._whiff_sigmas
        smelt = whiffs.q if whiffs.fresh > limit else None
        return Move(goal, float(np.mean(self._fired)), whiffs.ppm, smelt, whiffs.level <= limit)
