"""Which way the LOW and HIGH ends of a joint are, in words, from the arm's Jacobian."""

import math

import numpy as np

from oio.core.errors import OioError
from oio.core.records import Array
from oio.kinematics.arm import Arm
from oio.kinematics.forward import nose_and_jacobian

LEVER_M = 0.03  # with a smaller lever arm the nose visibly rolls instead of moving


DIRECTIONS = (("forward", "back"), ("to the arm's left", "to the arm's right"), ("up", "down"))  # along +x and -x, y, z of the base


def end_directions(arm: Arm) -> list[tuple[str, str]]:
    """Describe, per joint of the whole arm, how the nose moves when the joint leaves home for its LOW end, and for its HIGH end.

    Directions at the start of the move, not at its end: a joint that swings the nose half around brings it back on both sides.
    """
    jacobian = arm.nose_jacobian(arm.home)[1]  # dp/dq (3, n)
    return [
        _nose_direction(jacobian[:, i]) if math.hypot(*jacobian[:, i]) >= LEVER_M else _roll_direction(arm, i)
        for i in range(len(arm.all_names))
    ]


def _nose_direction(gradient: Array) -> tuple[str, str]:
    largest = int(np.argmax(np.abs(gradient)))
    plus, minus = (f"the nose goes {way}" for way in DIRECTIONS[largest])
    return (minus, plus) if gradient[largest] > 0 else (plus, minus)


def _roll_direction(arm: Arm, i: int) -> tuple[str, str]:
    """Roll direction seen along the line from joint to nose: an axis that points away from the viewer turns clockwise."""
    c, q = arm.chain, np.ascontiguousarray(arm.home[None, : i + 1])
    part = c._replace(poses=c.poses[: i + 1], axes=c.axes[: i + 1], kinds=c.kinds[: i + 1], locked=c.locked[: i + 1])
    anchor, tip = (nose_and_jacobian(q, part._replace(offset=offset), False)[0][0] for offset in (np.zeros(3), c.axes[i]))
    along_m = float((tip - anchor) @ (arm.nose(arm.home) - anchor))
    if abs(along_m) < LEVER_M:
        raise OioError(
            f"{arm.all_names[i]} of arm '{arm.name}' neither moves its nose nor has it in front, so its directions cannot be described. "
            f"Homing needs a nose at least {LEVER_M} m away from the joint: put the site 'nose' of its MJCF there."
        )
    rolls = "the nose rolls counterclockwise, seen from behind it", "the nose rolls clockwise, seen from behind it"
    return rolls if along_m > 0 else rolls[::-1]
