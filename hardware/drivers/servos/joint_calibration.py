"""A joint that was turned from its LOW end to its HIGH end, which way that is in words, and the zero and direction that follow."""

import math
from collections.abc import Sequence

import numpy as np

from oio.core.errors import OioError
from oio.core.records import Array
from oio.kinematics.arm import Arm
from oio.kinematics.forward import nose_and_jacobian
from oio.kinematics.homing import Homing

MAX_STEP_TURNS = 0.25  # of a turn: more between two looks is a wrap
MISFIT_DEG = 15.0  # ends that are farther from the MJCF's than this are not its ends
MIN_SEPARATION = 0.5  # of what it was turned by: where Enter was pressed at LOW and at HIGH must be farther apart, or they are no two ends
LEVER_M = 0.03  # a nose on a smaller circle than this is seen to roll, not to go anywhere
DIRECTIONS = (("forward", "back"), ("to the arm's left", "to the arm's right"), ("up", "down"))  # along +x and -x, y, z of the base


def end_directions(arm: Arm) -> list[tuple[str, str]]:
    """Per joint of the whole arm in words what the nose does when the joint leaves the home pose for its LOW end, and for its HIGH end.

    At once, not at the ends: a joint that swings the nose half around brings it back on both sides.
    """
    slopes = arm.nose_jacobian(arm.home)[1]  # dp/dq (3, n)
    return [
        _nose_direction(slopes[:, i]) if math.hypot(*slopes[:, i]) >= LEVER_M else _roll_direction(arm, i)
        for i in range(len(arm.all_names))
    ]


def _nose_direction(slope: Array) -> tuple[str, str]:
    most = int(np.argmax(np.abs(slope)))
    plus, minus = (f"the nose goes {way}" for way in DIRECTIONS[most])
    return (minus, plus) if slope[most] > 0 else (plus, minus)


def _roll_direction(arm: Arm, i: int) -> tuple[str, str]:
    """Seen along the line from the joint to the nose: an axis that points away turns clockwise."""
    c, q = arm.chain, np.ascontiguousarray(arm.home[None, : i + 1])
    part = c._replace(poses=c.poses[: i + 1], axes=c.axes[: i + 1], kinds=c.kinds[: i + 1], locked=c.locked[: i + 1])
    anchor, tip = (nose_and_jacobian(q, part._replace(offset=offset), False)[0][0] for offset in (np.zeros(3), c.axes[i]))
    along_m = float((tip - anchor) @ (arm.nose(arm.home) - anchor))
    if abs(along_m) < LEVER_M:
        raise OioError(
            f"{arm.all_names[i]} of arm '{arm.name}' neither moves its nose nor has it in front, so that its ends have no words. "
            f"Homing needs a nose at least {LEVER_M} m away from the joint: put the site 'nose' of its MJCF there."
        )
    rolls = "the nose rolls counterclockwise, seen from behind it", "the nose rolls clockwise, seen from behind it"
    return rolls if along_m > 0 else rolls[::-1]


class JointSweep:
    """Counts of one joint while a person turned it from its LOW end to its HIGH end, `ends_deg` in the MJCF."""

    def __init__(self, name: str, per_turn: int, ends_deg: tuple[float, float]) -> None:
        self.name, self._per_turn, self._last = name, per_turn, -1
        self._least, self._most, self._named = per_turn, -1, list[int]()
        self._ends_deg = ends_deg
        marks = f"{ends_deg[0]:.0f} and {ends_deg[1]:.0f} degrees from its middle (its zero in the MJCF)"
        self._marks = f"or put tape marks at {marks} and turn it to the marks, not past them"

    def add(self, counts: int) -> None:
        """One look. Raises OioError where the count wraps: a joint's range must lie within one turn of its servo."""
        if self._last >= 0 and abs(counts - self._last) > MAX_STEP_TURNS * self._per_turn:
            raise OioError(
                f"the count of {self.name} jumped from {self._last} to {counts}: its servo's turn wraps inside the joint's range. Take the "
                f"horn off, turn the servo to its middle ({self._per_turn // 2}), put the horn on with the joint in its middle, and home "
                f"again; if the joint turns on without end, {self._marks.removeprefix('or ')}."
            )
        self._last = counts
        self._least, self._most = min(self._least, counts), max(self._most, counts)

    def stop(self) -> None:
        """Enter was pressed: where the joint is now is its LOW end; the second time, its HIGH end."""
        self._named.append(self._last)

    @property
    def _ends(self) -> tuple[int, int]:
        """Counts. Extremes, because a joint may sag from its stop before Enter is pressed; but it may also have been past tape marks, and
        then Enter was pressed at the ends: of the two, those that are as far apart as the MJCF's."""
        return min((self._least, self._most), (min(self._named), max(self._named)), key=self._misfit_deg)

    def _deg(self, ends: tuple[int, int]) -> float:
        return 360.0 * max(ends[1] - ends[0], 0) / self._per_turn

    def _misfit_deg(self, ends: tuple[int, int]) -> float:
        return abs(self._deg(ends) - (self._ends_deg[1] - self._ends_deg[0]))

    @property
    def span_deg(self) -> float:
        """From end to end."""
        return self._deg(self._ends)

    @property
    def misfit_deg(self) -> float:
        """How much more or less that is than in the MJCF."""
        return self._misfit_deg(self._ends)

    @property
    def middle(self) -> float:
        """Counts midway between the ends."""
        return sum(self._ends) / 2.0

    @property
    def sign(self) -> int:
        """+1: counts rise from LOW to HIGH; -1. Raises OioError if the joint was not turned from the one to the other."""
        wide = self._ends_deg[1] - self._ends_deg[0]
        if self.misfit_deg > MISFIT_DEG:
            raise OioError(
                f"{self.name} was turned by {self.span_deg:.0f} degrees, but its ends in the MJCF are {wide:.0f} degrees apart. Turn it "
                f"all the way to both ends, {self._marks}; then home again; nothing was written."
            )
        low, high = self._named
        if abs(high - low) <= MIN_SEPARATION * (self._ends[1] - self._ends[0]):
            raise OioError(
                f"{self.name} was at {low} counts when Enter was pressed for its LOW end and at {high} for its HIGH end: that is the same "
                f"side, though it was turned by {self.span_deg:.0f} degrees. Turn it to the end that is named and hold it there while "
                f"you press Enter; home again; nothing was written."
            )
        return 1 if high > low else -1


def homing_from_sweeps(rounds: Sequence[Sequence[JointSweep]], arm: Arm, per_turn: int) -> Homing:
    """Zeros of all joints of the whole arm, directions and standard uncertainties. Raises OioError if ends are not those of the MJCF, or
    if rounds disagree in which end is which.

    The middle of the ends that were reached is the middle of the MJCF's limits. u^2 = s^2 / n of the rounds + (misfit / 2)^2 / 3 (an end
    that was not reached) + (backlash / 2)^2 / 3 + (1 count)^2 / 12, rectangles as in GUM 4.3.7.
    """
    zeros, signs, u_deg = list[int](), list[int](), list[float]()
    degrees = 360.0 / per_turn
    for i, turns in enumerate(zip(*rounds, strict=True)):
        sign = _common_sign(turns)
        misfit, middles = max(turn.misfit_deg for turn in turns), np.array([turn.middle for turn in turns])
        zeros.append(round(float(np.mean(middles)) - sign * sum(ends_deg(arm, i)) / 2.0 / degrees))
        signs.append(sign)
        spread = degrees * float(np.std(middles, ddof=1)) / math.sqrt(len(turns)) if len(turns) > 1 else 0.0
        u_deg.append(math.sqrt(spread**2 + (misfit / 2.0) ** 2 / 3.0 + (arm.backlash_deg / 2.0) ** 2 / 3.0 + degrees**2 / 12.0))
    return Homing(tuple(zeros), tuple(signs), tuple(u_deg))


def _common_sign(turns: Sequence[JointSweep]) -> int:
    signs = [turn.sign for turn in turns]
    other = next((k for k, sign in enumerate(signs) if sign != signs[0]), None)
    if other is not None:
        raise OioError(
            f"{turns[0].name} was turned from LOW to HIGH one way in round 1 and the other way in round {other + 1}: its ends were "
            f"taken for each other once, and a joint homed so would move mirrored. Home again, with the arm at its home when you "
            f"read which way LOW and HIGH are; nothing was written."
        )
    return signs[0]


def ends_deg(arm: Arm, i: int) -> tuple[float, float]:
    """LOW and HIGH of joint i in the MJCF."""
    return math.degrees(arm.low_rad[i]), math.degrees(arm.high_rad[i])
