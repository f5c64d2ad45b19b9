"""Air that another program made: wind, concentration or puffs over time, from NPZ, NetCDF or GADEN's result folders.

What is in a file is data: it is never unpickled, and every unit and shape is checked.

NPZ (`numpy.savez`): `t_s` (T,); `x_m` (X,), `y_m` (Y,), `z_m` (Z,) with equal steps; `wind_m_s` (T, X, Y, Z, 3), `ppm` (T, X, Y, Z) or
both. Instead of `ppm`, puffs: `puff_frame` (n,) the index into t_s, `puff_m` (n, 3), `puff_sigma_m` (n,), `puff_ml` (n,) pure gas in each.
With gas: `source_m` (3,) and `rate_ml_s`, its emission. NetCDF (classic, 3): variables t, x, y, z, and u, v, w (t, x, y, z),
c (t, x, y, z) or both, each with an attribute `units`; with gas also the global attributes `source_m` and `rate_ml_s`.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import netcdf_file

from hardware.air.grid import FieldSeries
from oio.core.errors import BadInput
from oio.core.records import Array
from oio.core.settings import itself

UNITS = {  # to m, s, m/s, ppm
    "length": {"m": 1.0, "metre": 1.0, "meter": 1.0, "cm": 1e-2, "mm": 1e-3},
    "time": {"s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "min": 60.0, "ms": 1e-3},
    "speed": {"m/s": 1.0, "m s-1": 1.0, "m s^-1": 1.0, "cm/s": 1e-2, "mm/s": 1e-3},
    "concentration": {"ppm": 1.0, "ppb": 1e-3, "1": 1e6, "mol/mol": 1e6, "mol mol-1": 1e6, "%": 1e4},
}
KINDS = {"t": "time", "x": "length", "y": "length", "z": "length", "u": "speed", "v": "speed", "w": "speed", "c": "concentration"}
MOST_BYTES = 4 * 2**30
HDF5 = b"\x89HDF\r\n\x1a\n"
CDF = b"CDF"


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


def read_npz(path: Path) -> AirRecording:
    """Read an NPZ; raises BadInput that names the key."""
    try:
        with np.load(path, allow_pickle=False) as archive:
            data = {key: archive[key] for key in archive.files}
    except (OSError, ValueError, KeyError, EOFError) as error:
        raise _bad(path, f"it is no NPZ of plain arrays ({error})") from None
    t_s = _axis(path, data, "t_s")
    wind = gas = None
    if "wind_m_s" in data or "ppm" in data:
        axes = [_axis(path, data, f"{axis}_m") for axis in "xyz"]
        wind = _series(path, "wind_m_s", data["wind_m_s"], t_s, axes, 3) if "wind_m_s" in data else None
        gas = _series(path, "ppm", data["ppm"], t_s, axes, 1) if "ppm" in data else None
    puffs = _puffs(path, data, t_s) if "puff_m" in data else None
    source, rate = data.get("source_m"), data.get("rate_ml_s")
    return _recording(path, wind, gas if puffs is None else puffs, source, rate)


def read_netcdf(path: Path) -> AirRecording:
    """Read a NetCDF of the classic format; units come from the attributes, and one that is unknown is refused."""
    with path.open("rb") as file:
        if file.read(len(HDF5)) == HDF5:
            raise _bad(path, "it is NetCDF-4, which is HDF5; the classic format is read. Type nccopy -k classic FILE NEW")
    try:
        with netcdf_file(str(path), "r", mmap=False) as file:
            data = {name: _converted(path, name, variable) for name, variable in file.variables.items() if name in KINDS}
            source, rate = getattr(file, "source_m", None), getattr(file, "rate_ml_s", None)
    except (TypeError, OSError, ValueError, IndexError, AssertionError) as error:
        raise _bad(path, f"it is no NetCDF of the classic format ({error})") from None
    axes = [_axis(path, data, axis) for axis in "txyz"]
    wind = gas = None
    if "u" in data or "v" in data or "w" in data:
        missing = [name for name in "uvw" if name not in data]
        if missing:
            raise _bad(path, f"it has no variable '{missing[0]}', but wind has u, v and w")
        wind = _series(path, "u, v, w", np.stack([data[name] for name in "uvw"], axis=-1), axes[0], axes[1:], 3)
    if "c" in data:
        gas = _series(path, "c", data["c"], axes[0], axes[1:], 1)
    return _recording(path, wind, gas, source, rate)


def _converted(path: Path, name: str, variable: Any) -> Array:
    given = getattr(variable, "units", b"")
    unit, known = given.decode("utf-8", "replace").strip() if isinstance(given, bytes) else str(given), UNITS[KINDS[name]]
    if unit not in known:
        raise BadInput(f"{path}: variable '{name}' has the unit '{unit}', but a {KINDS[name]} is in {', '.join(known)}.")
    return np.array(variable[:], dtype=np.float64) * known[unit]


def _recording(path: Path, wind: FieldSeries | None, gas: FieldSeries | Puffs | None, source: Any, rate: Any) -> AirRecording:
    if wind is None and gas is None:
        raise _bad(path, "it has neither wind nor gas")
    if gas is None:
        return AirRecording(wind)
    place, ml_s = (np.array([], dtype=float) if v is None else np.atleast_1d(np.asarray(v, dtype=np.float64)) for v in (source, rate))
    if place.shape != (3,) or not np.all(np.isfinite(place)):
        raise _bad(path, "gas needs source_m, the three coordinates of its source [m]")
    if ml_s.shape != (1,) or not float(ml_s[0]) > 0.0:
        raise _bad(path, "gas needs rate_ml_s, the emission of its source [ml/s], above 0")
    return AirRecording(wind, gas, place, float(ml_s[0]))


def _axis(path: Path, data: dict[str, Array], name: str) -> Array:
    if name not in data:
        raise _bad(path, f"it has no '{name}'")
    axis = np.atleast_1d(np.asarray(data[name], dtype=np.float64))
    if axis.ndim != 1 or not np.all(np.isfinite(axis)) or (len(axis) > 1 and np.any(np.diff(axis) <= 0.0)) or not len(axis):
        raise _bad(path, f"'{name}' does not increase")
    if not name.startswith("t") and len(axis) > 2 and np.ptp(np.diff(axis)) > 1e-3 * np.mean(np.diff(axis)):
        raise _bad(path, f"the steps of '{name}' are not equal; resample the field")
    return axis


def _series(path: Path, name: str, values: Array, t_s: Array, axes: list[Array], components: int) -> FieldSeries:
    shape = (len(t_s), *(len(axis) for axis in axes), *((components,) if components > 1 else ()))
    if values.shape != shape:
        raise _bad(path, f"'{name}' has the shape {values.shape}, but its axes say {shape}")
    if not np.all(np.isfinite(values)):
        raise _bad(path, f"'{name}' has values that are not finite; fill them, with 0 inside obstacles")
    if components == 1 and np.any(values < 0.0):
        raise _bad(path, f"'{name}' has negative concentrations")
    step = np.array([axis[1] - axis[0] if len(axis) > 1 else 1.0 for axis in axes])
    return FieldSeries(t_s, np.array([axis[0] for axis in axes]), step, values.reshape(*values.shape[:4], -1).astype(np.float32))


def _puffs(path: Path, data: dict[str, Array], t_s: Array) -> Puffs:
    missing = [key for key in ("puff_frame", "puff_sigma_m", "puff_ml") if key not in data]
    if missing:
        raise _bad(path, f"it has no '{missing[0]}'")
    frame, place, sigma, amount = (np.asarray(data[key]) for key in ("puff_frame", "puff_m", "puff_sigma_m", "puff_ml"))
    n = len(frame)
    if place.shape != (n, 3) or sigma.shape != (n,) or amount.shape != (n,):
        raise _bad(path, f"puff_m must be ({n}, 3), puff_sigma_m and puff_ml ({n},), as puff_frame has {n} entries")
    if not np.issubdtype(frame.dtype, np.integer) or (n and (np.any(frame < 0) or np.any(frame >= len(t_s)))):
        raise _bad(path, f"puff_frame must be indices into t_s, 0 to {len(t_s) - 1}")
    if not (np.all(np.isfinite(place)) and np.all(sigma > 0.0) and np.all(amount >= 0.0)):
        raise _bad(path, "puffs have a place that is not finite, a puff_sigma_m that is not above 0, or a negative puff_ml")
    order = np.argsort(frame, kind="stable")
    return Puffs(t_s, np.searchsorted(frame[order], np.arange(len(t_s) + 1)), place[order].astype(float), sigma[order], amount[order])


def _bad(path: Path, what: str) -> BadInput:
    return BadInput(f"{path}: {what}. The formats are in hardware/air/air_recording.py and docs/how-to/import_air.md.")


def check_size(path: Path, bytes_: int) -> None:
    """Refuse a file too large for memory."""
    if bytes_ > MOST_BYTES:
        raise _bad(path, f"it has {bytes_ / 2**30:.1f} GiB, at most {MOST_BYTES // 2**30} are read; thin it out in time or space")
