"""A field over time on a regular grid, interpolated linearly in space and time."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oio.core.compiled import compiled
from oio.core.records import Array
from oio.core.settings import itself

Values = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class FieldSeries:
    """Values (T, X, Y, Z, C) float32 at times t_s (T,), on a grid from `low_m` (3,) on with spacing `step_m` (3,)."""

    t_s: Array
    low_m: Array
    step_m: Array
    values: Values
    __deepcopy__ = itself  # large, and never changed

    @property
    def high_m(self) -> Array:
        """The last grid point on every axis (3,) m."""
        return np.asarray(self.low_m + self.step_m * (np.array(self.values.shape[1:4]) - 1))

    @property
    def lasts_s(self) -> float:
        """Time between the first frame and the last."""
        return float(self.t_s[-1] - self.t_s[0])

    def at(self, t_s: float, places_m: Array) -> Array:
        """Values (n, C) at places (n, 3) m; before the first frame, after the last and outside the grid those of its edge."""
        after = int(np.clip(np.searchsorted(self.t_s, t_s, side="right"), 1, max(len(self.t_s) - 1, 1)))
        later = min(after, len(self.t_s) - 1)
        gap = float(self.t_s[later] - self.t_s[after - 1])
        share = float(np.clip((t_s - self.t_s[after - 1]) / gap, 0.0, 1.0)) if gap > 0.0 else 0.0
        out = np.zeros((len(places_m), self.values.shape[4]))
        for frame, weight in ((after - 1, 1.0 - share), (later, share)):
            if weight > 0.0:
                _add_interpolated(self.values[frame], np.ascontiguousarray((places_m - self.low_m) / self.step_m), weight, out)
        return out

    def inside(self, place_m: Array) -> bool:
        """Whether a place (3,) m lies on the grid."""
        return bool(np.all(place_m >= self.low_m) and np.all(place_m <= self.high_m))

    def covers(self, place_m: Array) -> bool:
        """Whether a place (3,) m lies on the grid or within a step of it: cell centres begin half a cell above the floor. A single layer
        is the same everywhere across it."""
        near = (place_m >= self.low_m - self.step_m) & (place_m <= self.high_m + self.step_m)
        return bool(np.all(near | (np.array(self.values.shape[1:4]) == 1)))


@compiled
def _add_interpolated(values: Values, at: Array, weight: float, out: Array) -> None:
    """Add `weight` times the trilinear interpolation of values (X, Y, Z, C) at grid coordinates (n, 3) to out (n, C)."""
    cell, part = np.zeros(3, dtype=np.int64), np.zeros(3)
    for i in range(len(at)):
        for a in range(3):
            last = values.shape[a] - 1
            x = min(max(at[i, a], 0.0), float(last))
            cell[a] = min(int(x), max(last - 1, 0))
            part[a] = x - cell[a]
        for corner in range(8):
            w = weight
            j0, j1, j2 = cell[0], cell[1], cell[2]
            for a in range(3):
                far = (corner >> a) & 1
                w *= part[a] if far else 1.0 - part[a]
                if far:
                    if a == 0:
                        j0 += 1
                    elif a == 1:
                        j1 += 1
                    else:
                        j2 += 1
            if w > 0.0:
                for c in range(values.shape[3]):
                    out[i, c] += w * values[j0, j1, j2, c]
