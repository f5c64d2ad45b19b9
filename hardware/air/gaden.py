"""Result folders of GADEN (filament_simulator, versions 1 and 2): `iteration_0`, `iteration_1` ... and `wind/wind_iteration_0` ...

An iteration is a zlib stream: header, then (int32 index, x, y, z [m], sigma [cm]) of every filament. Moles of gas in a filament over moles
of air in a cm^3 are its volume of pure gas in ml. A wind file has U, V, W as float64, x fastest. Time is not in the files: `frame_s` is
GADEN's `results_time_step`. The emission is the gas of the first frame that has any, over its time.
"""

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hardware.air.air_recording import AirRecording, Puffs, check_size
from hardware.air.grid import FieldSeries, Values
from oio.core.errors import BadInput
from oio.core.records import Array

FILAMENT = np.dtype([("index", "<i4"), ("place", "<f8", 3), ("sigma_cm", "<f8")])
MOST_FRAME_BYTES = 2**30


@dataclass(frozen=True, slots=True, eq=False)
class _Frame:
    cells: tuple[int, int, int]
    low_m: tuple[float, float, float]
    cell_m: float
    source_m: tuple[float, float, float]
    moles: float
    air_moles_cm3: float
    wind: int
    filaments: Array


def read_gaden(folder: Path, frame_s: float) -> AirRecording:
    """Read a result folder; raises BadInput that names the file, and what of GADEN must run first."""
    paths = list[Path]()
    while (path := folder / f"iteration_{len(paths)}").is_file():
        paths.append(path)
    if not paths:
        raise BadInput(f"{folder} has neither a CSV of wind nor GADEN's iteration_0: run its filament simulator with save_results first.")
    check_size(folder, sum(path.stat().st_size for path in paths))
    frames = [_read_frame(path) for path in paths]
    first = frames[0]
    t_s = np.asarray(frame_s * np.arange(len(frames)), dtype=np.float64)
    if any(frame.cells != first.cells or frame.low_m != first.low_m for frame in frames):
        raise BadInput(f"{folder}: iterations are of different environments. Empty the folder and run GADEN again.")
    counts = [len(frame.filaments) for frame in frames]
    if not sum(counts):
        raise BadInput(
            f"{folder}: no iteration has a filament, so the source released nothing. Look at GADEN's sim_time and filament rate."
        )
    amount = first.moles / first.air_moles_cm3
    flat = np.concatenate([frame.filaments for frame in frames])
    puffs = Puffs(
        t_s, np.concatenate([[0], np.cumsum(counts)]), flat["place"].astype(float), 1e-2 * flat["sigma_cm"], np.full(len(flat), amount)
    )
    if not (np.all(np.isfinite(puffs.place_m)) and np.all(puffs.sigma_m > 0.0)):
        raise BadInput(f"{folder}: filaments have places that are not finite, or a sigma that is not above 0.")
    begun = next(i for i, count in enumerate(counts) if count and i) if any(counts[1:]) else 0
    rate = amount * counts[begun] / max(t_s[begun], frame_s)
    return AirRecording(_wind(folder, frames, t_s), puffs, np.array(first.source_m), float(rate))


def _read_frame(path: Path) -> _Frame:
    inflate = zlib.decompressobj()
    try:
        data = inflate.decompress(path.read_bytes(), MOST_FRAME_BYTES)
        if inflate.unconsumed_tail or not inflate.eof:
            raise BadInput(f"{path} is cut off, or holds more than {MOST_FRAME_BYTES // 2**20} MiB.")
        (version,) = struct.unpack_from("<i", data)
        if version == 1:
            low, cells, at = struct.unpack_from("<3d", data, 4), struct.unpack_from("<3i", data, 52), 64
            cell_m, source = struct.unpack_from("<d", data, at)[0], struct.unpack_from("<3d", data, at + 24)
            at += 48
        elif version == 2:
            cells, low = struct.unpack_from("<3i", data, 8), struct.unpack_from("<3f", data, 20)
            cell_m, source, at = struct.unpack_from("<f", data, 44)[0], struct.unpack_from("<3f", data, 48), 60
        else:
            raise BadInput(f"{path} is of version {version} of GADEN's results; 1 and 2 are read.")
        moles, air = struct.unpack_from("<2d", data, at + 4)
        (wind,) = struct.unpack_from("<i", data, at + 20)
    except (zlib.error, struct.error) as error:
        raise BadInput(f"{path} is no iteration of GADEN's filament simulator ({error}).") from None
    body = data[at + 24 :]
    if min(cells) < 1 or not cell_m > 0.0 or not moles > 0.0 or not air > 0.0 or len(body) % FILAMENT.itemsize:
        raise BadInput(f"{path} is damaged: cells {cells} of {cell_m:g} m, and {len(body)} bytes of filaments.")
    low_m, source_m = (float(low[0]), float(low[1]), float(low[2])), (float(source[0]), float(source[1]), float(source[2]))
    return _Frame((cells[0], cells[1], cells[2]), low_m, float(cell_m), source_m, moles, air, wind, np.frombuffer(body, FILAMENT))


def _wind(folder: Path, frames: list[_Frame], t_s: Array) -> FieldSeries | None:
    """Wind of every frame, None if no wind was saved."""
    first, used = frames[0], sorted({frame.wind for frame in frames})
    paths = {i: folder / "wind" / f"wind_iteration_{i}" for i in used}
    if not any(path.is_file() for path in paths.values()):
        return None
    check_size(folder, len(frames) * 12 * int(np.prod(first.cells)))
    fields = {i: _read_wind(path, first.cells) for i, path in paths.items()}
    low_m = np.array(first.low_m) + 0.5 * first.cell_m
    return FieldSeries(t_s, low_m, np.full(3, first.cell_m), np.stack([fields[frame.wind] for frame in frames]))


def _read_wind(path: Path, cells: tuple[int, int, int]) -> Values:
    if not path.is_file():
        raise BadInput(f"{path} is missing, but an iteration refers to it. Copy GADEN's folder whole.")
    data = np.fromfile(path, "<f8")
    if data.size != 3 * int(np.prod(cells)):
        raise BadInput(f"{path} has {data.size} values, but three for each of {cells[0]} x {cells[1]} x {cells[2]} cells are needed.")
    return np.asarray(data.reshape(3, cells[2], cells[1], cells[0]).transpose(3, 2, 1, 0), dtype=np.float32)
