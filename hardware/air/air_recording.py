"""Air that another program made: wind, concentration or puffs over time, and the checks that every file format shares.

What is in a file is data: it is never unpickled, and every unit and shape is checked.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hardware.air.grid import FieldSeries
from oio.core.errors import BadInput
from oio.core.records import Array
from oio.core.settings import itself

MOST_BYTES = 4 * 2**30
MOST_M_S = 100.0  # a faster wind is a fill value, or in another unit
ROUNDED = 0.02  # a rounded axis may be off by this share of a step


@dataclass(frozen=True, slots=True, eq=False)
class Puffs:
    """Gaussian puffs of many frames: `begins` (T + 1,) into the rows, centres (n, 3) m, standard deviations (n,) m, pure gas (n,) ml."""

    t_s: Array
    begins: NDArray[np.int64]
    place_m: Array
    sigma_m: Array
    amount_ml: Array
    __deepcopy__ = itself  # large, and never changed

    def ppm(self, t_s: float, p_m: Array) -> float:
        """Concentration at p (3,) m: sum of Q / ((2 pi)^1.5 sigma^3) exp(-d^2 / 2 sigma^2); 1 ml in 1 m^3 is 1 ppm. A frame holds until
        the next."""
        frame = int(np.clip(np.searchsorted(self.t_s, t_s, side="right") - 1, 0, len(self.t_s) - 1))
        rows = slice(self.begins[frame], self.begins[frame + 1])
        d2 = np.sum((self.place_m[rows] - p_m) ** 2, axis=1)
        variance = self.sigma_m[rows] ** 2
        return float(np.sum(self.amount_ml[rows] * (2.0 * np.pi * variance) ** -1.5 * np.exp(-0.5 * d2 / variance)))


@dataclass(frozen=True, slots=True, eq=False)
class AirRecording:
    """What a file has: wind (C = 3), concentration (C = 1) or puffs, and the source and emission rate that made the gas."""

    wind: FieldSeries | None = None
    gas: FieldSeries | Puffs | None = None
    source_m: Array | None = None
    rate_ml_s: float | None = None


def checked_recording(path: Path, wind: FieldSeries | None, gas: FieldSeries | Puffs | None, source: Any, rate: Any) -> AirRecording:
    """Return the recording; raises BadInput if it is empty, or has gas without its source and emission."""
    if wind is None and gas is None:
        raise bad_file(path, "it has neither wind nor gas")
    if gas is None:
        return AirRecording(wind)
    place, ml_s = (_numbers(value) for value in (source, rate))
    if place.shape != (3,) or not np.all(np.isfinite(place)):
        raise bad_file(path, "gas needs source_m, the three coordinates of its source [m]")
    if ml_s.shape != (1,) or not float(ml_s[0]) > 0.0:
        raise bad_file(path, "gas needs rate_ml_s, the emission of its source [ml/s], above 0")
    return AirRecording(wind, gas, place, float(ml_s[0]))


def _numbers(value: Any) -> Array:
    """Numbers (n,); none if there is no value, or a text."""
    try:
        return np.array([], dtype=float) if value is None else np.atleast_1d(np.asarray(value, dtype=np.float64))
    except (TypeError, ValueError):
        return np.array([], dtype=float)


def checked_axis(path: Path, data: dict[str, Array], name: str) -> Array:
    """Return an axis; raises BadInput unless it increases, and in space by equal steps."""
    if name not in data:
        raise bad_file(path, f"it has no '{name}'")
    axis = np.atleast_1d(np.asarray(data[name], dtype=np.float64))
    if axis.ndim != 1 or not np.all(np.isfinite(axis)) or (len(axis) > 1 and np.any(np.diff(axis) <= 0.0)) or not len(axis):
        raise bad_file(path, f"'{name}' does not increase")
    even = np.linspace(axis[0], axis[-1], len(axis))
    if not name.startswith("t") and len(axis) > 2 and np.max(np.abs(axis - even)) > ROUNDED * (even[1] - even[0]):
        raise bad_file(path, f"the steps of '{name}' are not equal; resample the field")
    return axis


def checked_series(path: Path, name: str, values: Array, t_s: Array, axes: list[Array], components: int) -> FieldSeries:
    """Return a field of values (T, X, Y, Z) or (T, X, Y, Z, components) on its axes; raises BadInput that names it."""
    shape = (len(t_s), *(len(axis) for axis in axes), *((components,) if components > 1 else ()))
    if values.shape != shape:
        raise bad_file(path, f"'{name}' has the shape {values.shape}, but its axes say {shape}")
    if not np.all(np.isfinite(values)):
        raise bad_file(path, f"'{name}' has values that are not finite; fill them, with 0 inside obstacles")
    if components == 1 and np.any(values < 0.0):
        raise bad_file(path, f"'{name}' has negative concentrations")
    if components == 3:
        check_speed(path, values)
    step = np.array([(axis[-1] - axis[0]) / (len(axis) - 1) if len(axis) > 1 else 1.0 for axis in axes])
    return FieldSeries(t_s, np.array([axis[0] for axis in axes]), step, values.reshape(*values.shape[:4], -1).astype(np.float32))


def check_speed(path: Path, wind_m_s: Array) -> None:
    """Refuse a wind that no room has; missing values are often filled with -9999 or 1e20."""
    most = float(np.max(np.abs(wind_m_s), initial=0.0))
    if most > MOST_M_S:
        raise bad_file(path, f"its wind is up to {most:.3g} m/s, and more than {MOST_M_S:g} is none: a fill value, or another unit")


def bad_file(path: Path, what: str) -> BadInput:
    """Return the error that says what is wrong with a file, and where its format is described."""
    return BadInput(f"{path}: {what}. The formats are in docs/how-to/import_air.md.")


def check_size(path: Path, bytes_: int) -> None:
    """Refuse a file too large for memory."""
    if bytes_ > MOST_BYTES:
        raise bad_file(path, f"it has {bytes_ / 2**30:.1f} GiB, at most {MOST_BYTES // 2**30} are read; thin it out in time or space")
