"""Joint calibration (homing): zero and direction of a joint's counts from a sweep by hand from its LOW end to its HIGH end."""

import math
from collections.abc import Sequence

import numpy as np

from oio.core.errors import OioError
from oio.kinematics.arm import Arm
from oio.kinematics.homing import Homing

MAX_STEP_TURNS = 0.25  # fraction of a turn: a larger step between two readings is a wrap of the count
MISFIT_DEG = 15.0  # a span that differs by more from the MJCF's is not that of its ends
MIN_SEPARATION = 0.5  # fraction of the span: the positions at the LOW and HIGH key presses must be farther apart to be two ends


class JointSweep:
    """Counts of one joint during a sweep by hand from its LOW end to its HIGH end, whose angles in the MJCF are `ends_deg`."""

    def __init__(self, name: str, per_turn: int, ends_deg: tuple[float, float]) -> None:
        self.name, self._per_turn, self._last = name, per_turn, -1
        self._lowest, self._highest, self._marked = per_turn, -1, list[int]()
        self._ends_deg = ends_deg
        marks = f"{ends_deg[0]:.0f} and {ends_deg[1]:.0f} degrees from its middle (its zero in the MJCF)"
        self._marks = f"or put tape marks at {marks} and turn it to the marks, not past them"

    def add(self, counts: int) -> None:
        """Add one position reading. Raises OioError where the count wraps: a joint's range must lie within one turn of its servo."""
        if self._last >= 0 and abs(counts - self._last) > MAX_STEP_TURNS * self._per_turn:
            raise OioError(
                f"the count of {self.name} jumped from {self._last} to {counts}: its servo's turn wraps inside the joint's range. Take the "
                f"horn off, turn the servo to its middle ({self._per_turn // 2}), put the horn on with the joint in its middle, and home "
                f"again; if the joint turns on without end, {self._marks.removeprefix('or ')}."
            )
        self._last = counts
        self._lowest, self._highest = min(self._lowest, counts), max(self._highest, counts)

    def stop(self) -> None:
        """Mark the present position as the LOW end; at the second call, as the HIGH end."""
        self._marked.append(self._last)

    @property
    def _ends(self) -> tuple[int, int]:
        """End positions [counts]: either the extremes, because a joint may sag from its stop before Enter is pressed, or the positions at
        the two key presses, because it may have been turned past tape marks; whichever span is nearer to the MJCF's.
        """
        return min((self._lowest, self._highest), (min(self._marked), max(self._marked)), key=self._misfit_deg)

    def _deg(self, ends: tuple[int, int]) -> float:
        return 360.0 * max(ends[1] - ends[0], 0) / self._per_turn

    def _misfit_deg(self, ends: tuple[int, int]) -> float:
        return abs(self._deg(ends) - (self._ends_deg[1] - self._ends_deg[0]))

    @property
    def span_deg(self) -> float:
        """Angle from end to end [deg]."""
        return self._deg(self._ends)

    @property
    def misfit_deg(self) -> float:
        """Absolute difference between the measured span and the MJCF's [deg]."""
        return self._misfit_deg(self._ends)

    @property
    def middle(self) -> float:
        """Position midway between the ends [counts]."""
        return sum(self._ends) / 2.0

    @property
    def sign(self) -> int:
        """+1 if counts rise from LOW to HIGH, else -1. Raises OioError if the joint was not turned from one end to the other."""
        mjcf_deg = self._ends_deg[1] - self._ends_deg[0]
        if self.misfit_deg > MISFIT_DEG:
            raise OioError(
                f"{self.name} was turned by {self.span_deg:.0f} degrees, but its ends in the MJCF are {mjcf_deg:.0f} degrees apart. Turn "
                f"it all the way to both ends, {self._marks}; then home again; nothing was written."
            )
        low, high = self._marked
        if abs(high - low) <= MIN_SEPARATION * (self._ends[1] - self._ends[0]):
            raise OioError(
                f"{self.name} was at {low} counts when Enter was pressed for its LOW end and at {high} for its HIGH end: that is the same "
                f"side, though it was turned by {self.span_deg:.0f} degrees. Turn it to the end that is named and hold it there while "
                f"you press Enter; home again; nothing was written."
            )
        return 1 if high > low else -1


def homing_from_sweeps(rounds: Sequence[Sequence[JointSweep]], arm: Arm, per_turn: int) -> Homing:
    """Estimate zeros, directions and standard uncertainties of all joints of the whole arm. Raises OioError if the ends are not those of
    the MJCF, or if rounds disagree on which end is which.

    The middle of the measured ends is the middle of the MJCF's limits. u^2 = s^2 / n of the rounds + (misfit / 2)^2 / 3 (an
    end that was not reached) + (backlash / 2)^2 / 3 + (1 count)^2 / 12, rectangular distributions as in GUM 4.3.7.
    """
    zeros, signs, u_deg = list[int](), list[int](), list[float]()
    degrees = 360.0 / per_turn
    for i, sweeps in enumerate(zip(*rounds, strict=True)):
        sign = _common_sign(sweeps)
        misfit, middles = max(sweep.misfit_deg for sweep in sweeps), np.array([sweep.middle for sweep in sweeps])
        zeros.append(round(float(np.mean(middles)) - sign * sum(ends_deg(arm, i)) / 2.0 / degrees))
        signs.append(sign)
        spread = degrees * float(np.std(middles, ddof=1)) / math.sqrt(len(sweeps)) if len(sweeps) > 1 else 0.0
        u_deg.append(math.sqrt(spread**2 + (misfit / 2.0) ** 2 / 3.0 + (arm.backlash_deg / 2.0) ** 2 / 3.0 + degrees**2 / 12.0))
    return Homing(tuple(zeros), tuple(signs), tuple(u_deg))


def _common_sign(sweeps: Sequence[JointSweep]) -> int:
    signs = [sweep.sign for sweep in sweeps]
    other = next((k for k, sign in enumerate(signs) if sign != signs[0]), None)
    if other is not None:
        raise OioError(
            f"{sweeps[0].name} was turned from LOW to HIGH one way in round 1 and the other way in round {other + 1}: its ends were "
            f"taken for each other once, and a joint homed so would move mirrored. Home again, with the arm at its home when you "
            f"read which way LOW and HIGH are; nothing was written."
        )
    return signs[0]


def ends_deg(arm: Arm, i: int) -> tuple[float, float]:
    """Return the LOW and HIGH limits of joint i in the MJCF [deg]."""
    return math.degrees(arm.low_rad[i]), math.degrees(arm.high_rad[i])
