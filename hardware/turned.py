"""A joint that was turned from end to end, and the zero that follows."""

import math
from collections.abc import Sequence

import numpy as np

from oio.arm import Arm
from oio.errors import OioError
from oio.homing import Homing

STEP = 0.25  # of a turn: more between two looks is a wrap
MISFIT_DEG = 15.0  # ends that are farther from the MJCF's than this are not its ends


class Turned:
    """Counts of one joint while a person turned it."""

    def __init__(self, name: str, per_turn: int) -> None:
        self.name, self._per_turn, self._last = name, per_turn, -1
        self.low, self.high = per_turn, -1

    def add(self, counts: int) -> None:
        """One look. Raises OioError where the count wraps: a joint's range must lie within one turn of its servo."""
        if self._last >= 0 and abs(counts - self._last) > STEP * self._per_turn:
            raise OioError(
                f"the count of {self.name} jumped from {self._last} to {counts}: its servo's turn wraps inside the joint's range. Take the "
                f"horn off, turn the servo to its middle ({self._per_turn // 2}), put the horn on with the joint in its middle, and home "
                f"again."
            )
        self._last = counts
        self.low, self.high = min(self.low, counts), max(self.high, counts)

    @property
    def span(self) -> int:
        """Counts from end to end."""
        return max(self.high - self.low, 0)


def joined(rounds: Sequence[Sequence[Turned]], arm: Arm, signs: tuple[int, ...], per_turn: int) -> Homing:
    """Zeros of all joints of the whole arm and their standard uncertainties. Raises OioError if ends are not those of the MJCF.

    The middle of the ends that were reached is the middle of the MJCF's limits. u^2 = s^2 / n of the rounds + (misfit / 2)^2 / 3 (an end
    that was not reached) + (backlash / 2)^2 / 3 + (1 count)^2 / 12, rectangles as in GUM 4.3.7.
    """
    zeros, u_deg = list[int](), list[float]()
    degrees = 360.0 / per_turn
    for i, sign in enumerate(signs):
        low, high = np.degrees(arm.low_rad[i]), np.degrees(arm.high_rad[i])
        turns = [turned[i] for turned in rounds]
        misfit = max(abs(degrees * turn.span - (high - low)) for turn in turns)
        if misfit > MISFIT_DEG:
            worst = max(turns, key=lambda turn: abs(degrees * turn.span - (high - low)))
            raise OioError(
                f"{worst.name} was turned by {degrees * worst.span:.0f} degrees, but its ends in the MJCF are {high - low:.0f} degrees "
                f"apart. Turn it all the way to both ends, and home again; nothing was written."
            )
        middles = np.array([(turn.low + turn.high) / 2.0 for turn in turns])
        zeros.append(round(float(np.mean(middles)) - sign * (low + high) / 2.0 / degrees))
        spread = degrees * float(np.std(middles, ddof=1)) / math.sqrt(len(turns)) if len(turns) > 1 else 0.0
        u_deg.append(math.sqrt(spread**2 + (misfit / 2.0) ** 2 / 3.0 + (arm.backlash_deg / 2.0) ** 2 / 3.0 + degrees**2 / 12.0))
    return Homing(tuple(zeros), signs, tuple(u_deg))
