"""Which count is which angle: per joint a zero, a direction and how well the zero is known. Written by `python -m hardware.home`."""

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from oio.core.errors import BadInput
from oio.core.records import Array

TURN = 2.0 * math.pi
MOST_COUNTS = 1 << 16


@dataclass(frozen=True, slots=True)
class Homing:
    """Per joint, base to nose."""

    zero_counts: tuple[int, ...]
    sign: tuple[int, ...]  # +1: counts rise where the MJCF's angle does; -1
    u_deg: tuple[float, ...]  # standard uncertainty of the zero

    @staticmethod
    def nominal(joints: int, middle: int) -> "Homing":
        """As the servos come: the zero is in the middle, and nobody knows how well."""
        return Homing((middle,) * joints, (1,) * joints, (0.0,) * joints)

    def angles(self, counts: NDArray[np.int64], per_turn: int) -> Array:
        """rad (n,) of counts (n,)."""
        return np.asarray(np.array(self.sign) * (counts - np.array(self.zero_counts)) * (TURN / per_turn), dtype=np.float64)

    def counts(self, q_rad: Array, per_turn: int) -> NDArray[np.int64]:
        """Whole counts (n,) of angles (n,) rad."""
        return np.rint(np.array(self.zero_counts) + np.array(self.sign) * np.asarray(q_rad) * (per_turn / TURN)).astype(np.int64)

    def write(self, path: Path) -> None:
        """As JSON."""
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(asdict(self), indent=2) + "\n", encoding="utf-8")

    @staticmethod
    def read(path: str, joints: int) -> "Homing":
        """From JSON. Raises BadInput for a file that is not one, or one of another arm."""
        try:
            data = json.loads(Path(path).expanduser().read_text(encoding="utf-8"))
            read = Homing(tuple(data["zero_counts"]), tuple(data["sign"]), tuple(float(u) for u in data["u_deg"]))
        except (OSError, ValueError, TypeError, KeyError):
            raise BadInput(f"arm.homing={path} is no homing file. Make one: python -m hardware.home out={path}.") from None
        fits = {len(read.zero_counts), len(read.sign), len(read.u_deg)} == {joints}
        sane = fits and all(type(z) is int and 0 <= z < MOST_COUNTS for z in read.zero_counts) and all(s in (-1, 1) for s in read.sign)
        if not sane or not all(math.isfinite(u) and 0 <= u <= 180 for u in read.u_deg):
            raise BadInput(
                f"arm.homing={path} must have {joints} zeros of 0 to {MOST_COUNTS - 1} counts, signs of 1 or -1, and uncertainties of "
                f"0 to 180 degrees. Make it anew: python -m hardware.home out={path}."
            )
        return read
