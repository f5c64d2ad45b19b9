"""Wind at the cell centres of a CFD mesh, from the tables that ParaView (OpenFOAM), GADEN, STAR-CCM+, Fluent and CFX export.

A file is one moment; the CSV files of a folder are moments in the order of the numbers at the ends of their names, `frame_s` apart. A mesh
is no regular grid, so its wind is resampled: at each node of a grid as fine as the mesh, a linear fit of the nearest centres, weighted by
inverse squared distance. Where there is no mesh, as inside an obstacle, the wind is that of the nearest cells.
"""

import re
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from hardware.air.air_recording import AirRecording, bad_file, check_size, check_speed
from hardware.air.cell_table import read_cell_table
from hardware.air.grid import FieldSeries
from oio.core.records import Array

NEIGHBOURS = 12
MOST_NODES = 500_000
AT_ONCE = 20_000  # nodes
SAME_LEVEL = 1e-4  # of the mesh's extent: coordinates that agree so far are of one level
STRUCTURED = 4.0  # a mesh is structured if a lattice of its levels has at most so many times its centres
FOURTH = 4  # neighbour, whose distance is the size of a cell
ALIKE = 1e-3  # two winds at one place are alike within this of the largest speed


def read_cell_centres(path: Path, frame_s: float) -> AirRecording:
    """Read one table, or a folder of numbered CSV files; raises BadInput that names the file."""
    paths = _moments(path, frame_s) if path.is_dir() else [path]
    check_size(path, sum(p.stat().st_size for p in paths))
    frames = [_read(p) for p in paths]
    for p, frame in zip(paths, frames, strict=True):
        if frame.shape != frames[0].shape or not np.array_equal(frame[:, :3], frames[0][:, :3]):
            raise bad_file(p, f"its cell centres are not those of {paths[0].name}; export every moment on the same mesh")
    low_m, step_m, values = resampled(frames[0][:, :3], np.concatenate([frame[:, 3:] for frame in frames], axis=1))
    series = values.reshape(*values.shape[:3], len(frames), 3).transpose(3, 0, 1, 2, 4)
    return AirRecording(FieldSeries(frame_s * np.arange(len(frames), dtype=np.float64), low_m, step_m, series.astype(np.float32)))


def resampled(points_m: Array, values: Array) -> tuple[Array, Array, Array]:
    """Return a regular grid's first node (3,) [m], steps (3,) [m] and values (X, Y, Z, C), from values (n, C) at points (n, 3)."""
    cell_m = _cell_size(points_m)
    tree, count = cKDTree(points_m / cell_m), min(NEIGHBOURS, len(points_m))
    low_m, extent_m = np.min(points_m, axis=0), np.ptp(points_m, axis=0)
    step_m = _steps(extent_m, cell_m)
    axes = [low + step * np.arange(1 + round(length / step)) for low, step, length in zip(low_m, step_m, extent_m, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    out = np.empty((len(nodes), values.shape[1]))
    for begin in range(0, len(nodes), AT_ONCE):
        part = slice(begin, begin + AT_ONCE)
        away, nearest = tree.query(nodes[part] / cell_m, k=count)
        out[part] = _fitted((points_m[nearest] - nodes[part, None]) / cell_m, away, values[nearest])
    return low_m, step_m, out.reshape(*(len(axis) for axis in axes), -1)


def _cell_size(points_m: Array) -> Array:
    """Size of a cell along each axis (3,) [m]: of a structured mesh by its levels, else the same on all, by the distance of neighbours."""
    extent_m = np.ptp(points_m, axis=0)
    places = np.round((points_m - np.min(points_m, axis=0)) / (SAME_LEVEL * np.max(extent_m)))
    levels = np.array([len(np.unique(places[:, a])) for a in range(3)])
    if np.prod(levels, dtype=float) <= STRUCTURED * len(points_m):
        size = extent_m / np.maximum(levels - 1, 1)
        return np.asarray(np.where(size > 0.0, size, np.max(size)))
    away_m = cKDTree(points_m).query(points_m, k=min(FOURTH + 1, len(points_m)))[0][:, -1]
    return np.full(3, np.median(away_m))


def _steps(extent_m: Array, cell_m: Array) -> Array:
    """Equal steps (3,) [m] that divide every axis: the size of a cell, or more if there would be too many nodes."""
    steps = np.asarray(cell_m)
    while np.prod(1.0 + np.ceil(extent_m / steps)) > MOST_NODES:
        steps = 1.1 * steps
    return np.where(extent_m > 0.0, extent_m / np.maximum(np.round(extent_m / steps), 1.0), steps)


def _fitted(offsets: Array, away: Array, values: Array) -> Array:
    """Linear fits (m, C) at nodes, from values (m, k, C) at offsets (m, k, 3); within the range of those values.

    A small ridge on the slopes keeps them 0 where the neighbours do not tell them, as across a mesh of one layer.
    """
    scale = np.mean(away, axis=1)[:, None]
    weight = 1.0 / ((away / scale) ** 2 + 0.01)
    design = np.concatenate([np.ones((*away.shape, 1)), offsets / scale[:, :, None]], axis=2)
    weighted = design * weight[:, :, None]
    normal = np.einsum("mki,mkj->mij", weighted, design)
    normal[:, range(1, 4), range(1, 4)] += 1e-6 * np.sum(weight, axis=1)[:, None]
    centre = np.linalg.solve(normal, np.einsum("mki,mkc->mic", weighted, values))[:, 0]
    return np.asarray(np.clip(centre, np.min(values, axis=1), np.max(values, axis=1)))


def csv_files(folder: Path) -> list[Path]:
    """Files of a folder whose names end in .csv or .CSV."""
    return sorted(path for path in folder.iterdir() if path.suffix.lower() == ".csv" and path.is_file())


def _moments(folder: Path, frame_s: float) -> list[Path]:
    """CSV files of a folder, by the numbers at the ends of their names, which must be equally spaced."""
    paths = csv_files(folder)
    matches = [re.fullmatch(r"(.*?)(\d+(?:\.\d+)?)", path.stem) for path in paths]
    names = {match[1] for match in matches if match}
    if None in matches or len(names) != 1:
        raise bad_file(
            folder, "its CSV files are moments of one wind, so their names must be one word and a number, as wind_0.csv, wind_1.csv"
        )
    texts = [match[2] for match in matches if match]
    order = np.argsort([float(text) for text in texts], kind="stable")
    numbers = np.array([float(text) for text in texts])[order]
    gaps = np.diff(numbers)
    if len(gaps) and (np.ptp(gaps) > 1e-6 * np.max(gaps) or np.min(gaps) <= 0.0):
        raise bad_file(
            folder, f"the numbers of its CSV files are not equally spaced ({_listed(numbers)}): a moment is missing, or there twice"
        )
    if len(gaps) and any("." in text for text in texts) and abs(gaps[0] - frame_s) > 1e-6 * gaps[0]:
        raise bad_file(
            folder, f"its CSV files are {gaps[0]:g} apart by their names, but air.frame_s is {frame_s:g}. Type air.frame_s={gaps[0]:g}"
        )
    return [paths[i] for i in order]


def _listed(numbers: Array) -> str:
    return ", ".join(f"{number:g}" for number in numbers[:8]) + (", ..." if len(numbers) > 8 else "")


def _read(path: Path) -> Array:
    """Places and wind (n, 6) [m, m/s] in the order of the places, each once."""
    rows = read_cell_table(path)
    check_speed(path, rows[:, 3:])
    rows = rows[np.lexsort(rows[:, :3].T)]
    again = np.all(rows[1:, :3] == rows[:-1, :3], axis=1)
    differ = np.max(np.abs(rows[1:, 3:] - rows[:-1, 3:]), axis=1) > ALIKE * np.max(np.abs(rows[:, 3:]), initial=0.0)
    if np.any(again & differ):
        raise bad_file(path, f"{int(np.sum(again & differ))} places have two winds; export one moment, and no cell twice")
    rows = np.asarray(rows[np.concatenate([np.ones(min(len(rows), 1), dtype=bool), ~again])])
    if len(rows) < NEIGHBOURS:
        raise bad_file(path, f"it has {len(rows)} rows at different places, but a wind needs {NEIGHBOURS} at least")
    return rows
