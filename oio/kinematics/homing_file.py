"""Reader of homing files: those of `python -m hardware.home`, and LeRobot's calibration files."""

import json
import math
from pathlib import Path
from typing import Any

from oio.core.errors import BadInput
from oio.core.records import Array
from oio.kinematics.homing import Homing
from oio.kinematics.lerobot_homing import homing_from_lerobot, is_lerobot

MOST_COUNTS = 1 << 16


def read_homing(path: str, low: Array, high: Array) -> Homing:
    """Return the homing of joints with the limits `low`, `high` (n,) rad. Raises BadInput for any other file."""
    data = _json(path)
    return homing_from_lerobot(data, path, low, high) if is_lerobot(data) else _ours(data, path, len(low))


def _json(path: str) -> Any:
    file = Path(path).expanduser()
    try:
        return json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise _no_homing(path) from None
    except (OSError, ValueError) as error:
        raise BadInput(
            f"arm.homing={path} cannot be read as JSON ({error}). Give a whole homing file, or make one under another name: "
            f"python -m hardware.home out=homing.json."
        ) from None


def _ours(data: Any, path: str, joints: int) -> Homing:
    try:
        read = Homing(tuple(data["zero_counts"]), tuple(data["sign"]), tuple(float(u) for u in data["u_deg"]))
    except (ValueError, TypeError, KeyError):
        raise _no_homing(path) from None
    fits = {len(read.zero_counts), len(read.sign), len(read.u_deg)} == {joints}
    sane = fits and all(type(z) is int and 0 <= z < MOST_COUNTS for z in read.zero_counts) and all(s in (-1, 1) for s in read.sign)
    if not sane or not all(math.isfinite(u) and 0 <= u <= 180 for u in read.u_deg):
        raise BadInput(
            f"arm.homing={path} must have {joints} zeros of 0 to {MOST_COUNTS - 1} counts, signs of 1 or -1, and uncertainties of "
            f"0 to 180 degrees. Make it anew: python -m hardware.home out={path}."
        )
    return read


def _no_homing(path: str) -> BadInput:
    return BadInput(f"arm.homing={path} is no homing file. Make one: python -m hardware.home out={path}.")
