"""Air that another program made, played back: its gas as it is, or its wind with puffs of ours in it.

`ImportedGas` moves the recorded gas to wherever the source is, beacon or unknown: right where the room does not matter (open space), and an
approximation near walls. `ImportedWind` keeps the wind where it is and releases puffs at the source.
"""

import functools
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np

from hardware.air.air_recording import AirRecording, Puffs, check_size
from hardware.air.cell_centres import csv_files, read_cell_centres
from hardware.air.emitter import Emitter
from hardware.air.filament import Filament, LiveFilament
from hardware.air.gaden import read_gaden
from hardware.air.grid import FieldSeries
from hardware.air.netcdf import CDF, HDF5, read_netcdf
from hardware.air.npz import read_npz
from oio.core.errors import BadInput
from oio.core.folders import ROOT
from oio.core.records import Array
from oio.core.settings import Within, settings

AFTER_END = ("hold", "repeat")
SPIN_UP_STEP_S = 0.1
ZIP = b"PK"  # with which an NPZ begins


@settings
class ImportedGas:
    """Concentration or puffs from a file, moved to the source and scaled by its emission."""

    name: str
    path: str  # an NPZ, a NetCDF, or GADEN's folder of results
    frame_s: Annotated[float, Within(1e-3, 1e4)]  # of GADEN: time between two results; the other formats have their own times
    begins_s: Annotated[float, Within(0, 1e6)]  # how far into the recording a source opens: by then its plume should have developed
    after_end: str  # hold the last frame, or repeat from begins_s on

    def check(self) -> None:
        """Refuse an unknown way to go on."""
        _check_after_end(self.after_end)

    def open(self, truth: np.random.Generator, disturbance: np.random.Generator) -> "LiveImportedGas":
        """Read the file; nothing is drawn."""
        made = read_air(self.path, self.frame_s)
        if made.gas is None or made.source_m is None or made.rate_ml_s is None:
            raise BadInput(f"{self.path} has wind, but no gas. Type air=imported_wind air.path={self.path}, which releases puffs in it.")
        _check_begin(self.path, self.begins_s, made.gas.t_s)
        return LiveImportedGas(self, made.gas, made.source_m, made.rate_ml_s)


class LiveImportedGas:
    """The recorded gas about the open source."""

    def __init__(self, air: ImportedGas, gas: FieldSeries | Puffs, source_m: Array, rate_ml_s: float) -> None:
        self._air, self._gas, self._recorded_source_m, self._recorded_ml_s = air, gas, source_m, rate_ml_s
        self._moved_m, self._share, self._t_s = np.zeros(3), 0.0, 0.0

    def present(self, source_m: Array | None, emission_ml_s: float) -> None:
        """Replace the source, or remove it; the recording begins anew."""
        self._t_s = 0.0
        self._share = 0.0 if source_m is None else emission_ml_s / self._recorded_ml_s
        self._moved_m = np.zeros(3) if source_m is None else self._recorded_source_m - source_m

    def step(self, dt_s: float) -> None:
        """Play on."""
        self._t_s += dt_s

    def ppm(self, p_m: Array) -> float:
        """Concentration above background at (3,) m; 0 outside a recorded grid."""
        if self._share == 0.0:
            return 0.0
        t_s, p = _recording_time(self._air.begins_s, self._t_s, self._gas.t_s, self._air.after_end), p_m + self._moved_m
        if isinstance(self._gas, Puffs):
            return self._share * self._gas.ppm(t_s, p)
        return self._share * float(self._gas.at(t_s, p[None])[0, 0]) if self._gas.inside(p) else 0.0


@settings
class ImportedWind:
    """Puffs of a filament model in a wind from a file."""

    name: str
    path: str  # an NPZ, a NetCDF, a CSV of cell centres or a folder of them, or GADEN's folder of results
    frame_s: Annotated[float, Within(1e-3, 1e4)]  # of GADEN and of a folder of CSV files: time between two of them
    begins_s: Annotated[float, Within(0, 1e6)]  # how far into the recording a source opens
    after_end: str  # hold the last frame, or repeat from begins_s on
    base_m: Annotated[tuple[float, float, float], Within(-1e3, 1e3)]  # the arm's base in the frame of the file,
    turned_deg: Annotated[float, Within(-360, 360)]  # and its x axis, counted from the file's
    puffs: Filament  # its own mean wind is not used

    def check(self) -> None:
        """Refuse an unknown way to go on."""
        _check_after_end(self.after_end)

    def open(self, truth: np.random.Generator, disturbance: np.random.Generator) -> "LiveImportedWind":
        """Read the file; only turbulence is drawn."""
        wind = read_air(self.path, self.frame_s).wind
        if wind is None:
            raise BadInput(f"{self.path} has gas, but no wind. Type air=imported_gas air.path={self.path}.")
        _check_begin(self.path, self.begins_s, wind.t_s)
        if not wind.covers(np.array(self.base_m)):
            low, high = np.round(wind.low_m, 3).tolist(), np.round(wind.high_m, 3).tolist()
            raise BadInput(f"air.base_m is {list(self.base_m)}, but the wind in {self.path} is known from {low} to {high} m.")
        return LiveImportedWind(self, wind, disturbance)


class LiveImportedWind(LiveFilament):
    """Puffs that the recorded wind carries; beyond its grid, the wind at the edge."""

    def __init__(self, air: ImportedWind, wind: FieldSeries, rng: np.random.Generator) -> None:
        super().__init__(replace(air.puffs, wind_m_s=0.0), 0.0, rng)
        self._imported, self._wind = air, wind
        c, s = math.cos(math.radians(air.turned_deg)), math.sin(math.radians(air.turned_deg))
        self._to_file = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    def emit(self, emitters: Sequence[Emitter]) -> None:
        """Replace all sources; the plume develops for `spin_up_s` of simulation, in the wind that blew before, or the first frame's."""
        super().emit(())
        self._begin(emitters, -self._air.spin_up_s)
        for _ in range(round(self._air.spin_up_s / SPIN_UP_STEP_S) if emitters else 0):
            self.step(SPIN_UP_STEP_S)
        self._t_s = 0.0

    def set_wind(self, speed_m_s: float, turned_rad: float, lift_m_s: float) -> None:
        """Refused: the wind is the file's."""
        raise BadInput(
            "the wind of air=imported_wind comes from its file and cannot be changed. Choose a world that leaves the wind alone."
        )

    def step(self, dt_s: float) -> None:
        """Carry all puffs by the wind where they are, then as every filament model does."""
        a = self._imported
        t_s = _recording_time(a.begins_s, self._t_s, self._wind.t_s, a.after_end)
        places = self.places_m @ self._to_file.T + np.array(a.base_m)
        self.carry(self._wind.at(t_s, places) @ self._to_file * dt_s)
        super().step(dt_s)


@functools.lru_cache(maxsize=4)
def _read(path: Path, frame_s: float, changed_ns: int) -> AirRecording:
    if path.is_dir():
        return read_cell_centres(path, frame_s) if csv_files(path) else read_gaden(path, frame_s)
    check_size(path, path.stat().st_size)
    with path.open("rb") as file:
        begin = file.read(len(HDF5))
    if begin.startswith(CDF) or begin == HDF5:
        return read_netcdf(path)
    return read_npz(path) if begin.startswith(ZIP) or path.suffix == ".npz" else read_cell_centres(path, frame_s)


def read_air(name: str, frame_s: float) -> AirRecording:
    """Read a file or folder, relative to the current folder or the project's; raises BadInput if it is missing or not what it should be."""
    path = Path(name).expanduser()
    path = path if path.is_absolute() or path.exists() else ROOT / path
    if not path.exists():
        raise BadInput(
            f"air.path is {name}, but there is no such file or folder. Type air.path=FILE: an NPZ, a NetCDF, GADEN's results, "
            "or, of a wind, a CSV of cell centres."
        )
    return _read(path, frame_s, _changed_ns(path))


def _changed_ns(path: Path) -> int:
    """When a file, or the latest of a folder, was last written: what is overwritten in a folder leaves the folder's own time as it was."""
    return max(int(p.stat().st_mtime_ns) for p in (path, *(path.rglob("*") if path.is_dir() else ())))


def _check_after_end(after_end: str) -> None:
    if after_end not in AFTER_END:
        raise BadInput(f"air.after_end is '{after_end}', but it can be {' or '.join(AFTER_END)}. Type air.after_end=hold.")


def _check_begin(path: str, begins_s: float, t_s: Array) -> None:
    if begins_s > t_s[-1] - t_s[0]:
        raise BadInput(f"air.begins_s is {begins_s:g}, but {path} lasts {t_s[-1] - t_s[0]:g} s. Type air.begins_s=0.")


def _recording_time(begins_s: float, t_s: float, times_s: Array, after_end: str) -> float:
    """Time in the recording, t_s after a source opened."""
    lasts_s = float(times_s[-1] - times_s[0]) - begins_s
    played = t_s % lasts_s if after_end == "repeat" and lasts_s > 0.0 and t_s > 0.0 else t_s
    return float(times_s[0]) + max(begins_s + played, 0.0)
