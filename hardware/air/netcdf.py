"""Air in a NetCDF: variables t, x, y, z, and u, v, w, c of all four, each with an attribute `units`; NetCDF-4 through the package netCDF4.

Dimensions may stand in any order: the axes say which is which. An axis that falls is turned round; a steady field needs no t. Packed values
are unpacked (scale_factor, add_offset), and missing ones (_FillValue, missing_value) are refused. With gas also the global attributes
`source_m` and `rate_ml_s`.
"""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import netcdf_file

from hardware.air.air_recording import AirRecording, bad_file, checked_axis, checked_recording, checked_series
from hardware.air.units import factor
from oio.core.records import Array

KINDS = {"t": "time", "x": "length", "y": "length", "z": "length", "u": "speed", "v": "speed", "w": "speed", "c": "concentration"}
ALSO = {"t": "time"}  # a variable t beside time is another thing
AXES = "txyz"
FIELDS = {"u", "v", "w", "c"}
HDF5 = b"\x89HDF\r\n\x1a\n"
CDF = b"CDF"


def read_netcdf(path: Path) -> AirRecording:
    """Read a NetCDF; a unit that is missing or unknown is refused. Raises BadInput that names the variable."""
    data, source, rate = _contents(path)
    axes = [checked_axis(path, data, axis) for axis in AXES]
    wind = gas = None
    if "u" in data or "v" in data or "w" in data:
        missing = [name for name in "uvw" if name not in data]
        if missing:
            raise bad_file(path, f"it has no variable '{missing[0]}', but wind has u, v and w")
        wind = checked_series(path, "u, v, w", np.stack([data[name] for name in "uvw"], axis=-1), axes[0], axes[1:], 3)
    if "c" in data:
        gas = checked_series(path, "c", data["c"], axes[0], axes[1:], 1)
    return checked_recording(path, wind, gas, source, rate)


def _contents(path: Path) -> tuple[dict[str, Array], Any, Any]:
    """Variables in SI units and ppm, along t, x, y and z; the source's place and its emission."""
    try:
        with _opened(path) as file:
            given = dict(file.variables.items())
            named = {name: given[also] if (also := ALSO.get(name)) in given else given.get(name) for name in KINDS}
            found = {name: variable for name, variable in named.items() if variable is not None}
            axis_of = {found[axis].dimensions[0]: axis for axis in AXES if axis in found and len(found[axis].dimensions) == 1}
            data = {name: _converted(path, name, variable, axis_of) for name, variable in found.items()}
            data.setdefault("t", np.zeros(1))
            _turn_falling(data)
            return data, getattr(file, "source_m", None), getattr(file, "rate_ml_s", None)
    except (TypeError, OSError, ValueError, IndexError, AssertionError) as error:
        raise bad_file(path, f"it is no NetCDF that can be read ({error})") from None


def _opened(path: Path) -> Any:
    with path.open("rb") as file:
        classic = file.read(len(HDF5)) != HDF5
    if classic:
        return netcdf_file(str(path), "r", mmap=False, maskandscale=True)
    try:
        from netCDF4 import Dataset
    except ImportError:
        raise bad_file(
            path, "it is NetCDF-4, which is HDF5 and needs one more package. Type pip install 'oio[netcdf]', or nccopy -k classic FILE NEW"
        ) from None
    return Dataset(str(path))


def _turn_falling(data: dict[str, Array]) -> None:
    """Turn axes that fall, as heights from the ceiling down, and all fields along them, in place."""
    for i, axis in enumerate(AXES):
        if axis in data and data[axis].ndim == 1 and len(data[axis]) > 1 and np.all(np.diff(data[axis]) < 0.0):
            data[axis] = data[axis][::-1]
            for name in FIELDS & data.keys():
                data[name] = np.flip(data[name], axis=i)


def _converted(path: Path, name: str, variable: Any, axis_of: dict[str, str]) -> Array:
    given = getattr(variable, "units", b"")
    text = given.decode("utf-8", "replace") if isinstance(given, bytes) else str(given)
    unit = text.partition(" since ")[0].strip()  # as of `seconds since 2026-01-01`: only differences of time matter
    values = np.ma.filled(np.ma.asarray(variable[:], dtype=np.float64), np.nan) * factor(KINDS[name], unit, f"{path}: variable '{name}'")
    order = "".join(axis_of.get(dimension, "?") for dimension in variable.dimensions)
    if name not in FIELDS:
        return np.asarray(values)
    if sorted(order) == sorted("xyz"):  # a steady field
        values, order = values[None], "t" + order
    if sorted(order) != sorted(AXES):
        raise bad_file(path, f"'{name}' has the dimensions {', '.join(variable.dimensions)}, but those of t, x, y and z are wanted")
    return np.asarray(values.transpose([order.index(axis) for axis in AXES]))
