"""Homing from LeRobot's calibration file, {motor: {id, drive_mode, homing_offset, range_min, range_max}}; 4096 counts a turn.

LeRobot's angle of a joint is (count - (range_min + range_max) / 2) * 360 / 4095 degrees, and the models of its arms have their zeros in the
middle of the range, too. `homing_offset` is in the servo's own memory, where LeRobot has written it, and so in every count that is read.
"""

import math
from collections.abc import Mapping
from typing import Any

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.kinematics.homing import TURN, Homing

COUNTS = 4096
FULL_TURN_U_DEG = 5.0  # a joint whose range is the full turn has its zero where a person held it, by eye: assumption
KEYS = ("id", "range_min", "range_max")
MOST_OFF = 0.25  # a swept range may differ from the model's by this share of it


def is_lerobot(document: object) -> bool:
    """Whether a JSON document is a calibration file of LeRobot."""
    entries = list(document.values()) if isinstance(document, Mapping) else []
    return bool(entries) and all(isinstance(entry, Mapping) and "range_min" in entry for entry in entries)


def homing_from_lerobot(document: Mapping[str, Mapping[str, Any]], path: str, low: Array, high: Array) -> Homing:
    """Return the homing of joints with the limits `low`, `high` (n,) rad; servos have the ids 1 to n from the base, others are ignored.

    The zero is in the middle of the swept range; its uncertainty is half the difference to the model's, rectangular (GUM 4.3.7).
    Raises BadInput for a servo that is missing, values that are no counts, and a range that holds the wrap from 4095 to 0.
    """
    by_id = {entry.get("id"): (name, entry) for name, entry in document.items()}
    zeros, uncertainties = [], []
    for joint, (lowest, highest) in enumerate(zip(low, high, strict=True)):
        if joint + 1 not in by_id:
            raise BadInput(
                f"arm.homing={path} has no servo with id {joint + 1}, but the arm has {len(low)} joints. Give the file of this arm."
            )
        name, entry = by_id[joint + 1]
        first, last = (entry.get(key) for key in KEYS[1:])
        off = entry.get("homing_offset", 0)
        if type(off) is not int or abs(off) >= COUNTS:
            raise BadInput(
                f"arm.homing={path}: {name} has the homing_offset {off}, but it must be a whole number of counts within a turn, "
                f"-{COUNTS - 1} to {COUNTS - 1}. The file is damaged, or of other servos: calibrate with LeRobot again."
            )
        if type(first) is not int or type(last) is not int or not 0 <= first < last < COUNTS:
            given = f"arm.homing={path}: {name} has range_min {first} and range_max {last}"
            raise BadInput(
                f"{given}, but they must be whole counts of 0 to {COUNTS - 1}, the first the smaller one. A range that holds the wrap from "
                f"{COUNTS - 1} to 0 has no zero: calibrate with LeRobot again, with every joint in its middle when it asks for that."
            )
        swept, modelled = (last - first) * TURN / COUNTS, float(highest - lowest)
        full_turn = last - first >= COUNTS - 2
        if not full_turn and abs(swept - modelled) > MOST_OFF * modelled:
            given = f"arm.homing={path}: {name} was swept over {math.degrees(swept):.0f} degrees, but the model's joint has"
            raise BadInput(
                f"{given} {math.degrees(modelled):.0f}: it was not turned to both ends, or its count wrapped. Calibrate with LeRobot "
                f"again, or home the arm: python -m hardware.home."
            )
        zeros.append(round((first + last) / 2))
        off_deg = math.degrees(abs(swept - modelled)) / 2
        uncertainties.append(FULL_TURN_U_DEG if full_turn else off_deg / math.sqrt(3.0))
    return Homing(tuple(zeros), (1,) * len(zeros), tuple(uncertainties))
