"""Which count is which angle: per joint a zero, a direction and how well the zero is known. Written by `python -m hardware.home`."""

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from oio.core.records import Array

TURN = 2.0 * math.pi


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
