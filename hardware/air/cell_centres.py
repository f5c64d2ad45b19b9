"""Wind at the cell centres of a CFD mesh, from the CSV files that ParaView (OpenFOAM), GADEN, STAR-CCM+, Fluent and CFX write.

A file is one moment; of a folder, the files are moments in the order of the numbers at the ends of their names, `frame_s` apart. A header
line names the columns (`NAMES`), perhaps with their units, as `X (m)` or `Velocity u [ m s^-1 ]`; without units they are m and m/s. A mesh
is no regular grid, so its wind is resampled: at each node of a grid as fine as the mesh, a linear fit of the nearest centres, weighted by
inverse squared distance. The wind is 0 where no centre is near: inside obstacles, and outside a room that is no box.
"""

import csv
import re
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from hardware.air.air_recording import AirRecording, bad_file, check_size
from hardware.air.grid import FieldSeries
from hardware.air.units import factor
from oio.core.records import Array

NAMES = {  # in lower case
    axis: (f"points:{i}", f"points_{i}", axis, f"{axis}-coordinate") for i, axis in enumerate("xyz")
} | {
    component: (f"u:{i}", f"u_{i}", f"velocity:{i}", f"velocity_{i}", f"velocity[{'ijk'[i]}]", f"velocity {component}", f"{axis}-velocity",
                f"v{axis}", component)
    for i, (axis, component) in enumerate(zip("xyz", "uvw", strict=True))
}  # fmt: skip
HEADER_LINES = 20  # a header is among the first lines
NEIGHBOURS = 12
NEAR = 2.0  # a node is in the air if its nearest centre is within this many times that centre's distance to its own neighbours
FOURTH = 4  # of which the fourth counts: the nearest one may be a duplicate, or across a thin cell
MOST_NODES = 500_000
AT_ONCE = 20_000  # nodes


def read_cell_centres(path: Path, frame_s: float) -> AirRecording:
    """Read one CSV, or a folder of numbered ones; raises BadInput that names the file."""
    paths = _numbered(path) if path.is_dir() else [path]
    check_size(path, sum(p.stat().st_size for p in paths))
    frames = [_read(p) for p in paths]
    points = frames[0][:, :3]
    for p, frame in zip(paths, frames, strict=True):
        if frame.shape != frames[0].shape or not np.array_equal(frame[:, :3], points):
            raise bad_file(p, f"its cell centres are not those of {paths[0].name}; export every moment on the same mesh")
    low_m, step_m, values = resampled(points, np.concatenate([frame[:, 3:] for frame in frames], axis=1))
    series = values.reshape(*values.shape[:3], len(frames), 3).transpose(3, 0, 1, 2, 4)
    return AirRecording(FieldSeries(frame_s * np.arange(len(frames), dtype=np.float64), low_m, step_m, series.astype(np.float32)))


def resampled(points_m: Array, values: Array) -> tuple[Array, Array, Array]:
    """Return a regular grid's first node (3,) [m], steps (3,) [m] and values (X, Y, Z, C), from values (n, C) at points (n, 3)."""
    tree = cKDTree(points_m)
    spacing = tree.query(points_m, k=min(FOURTH + 1, len(points_m)))[0][:, -1]
    low_m, extent = np.min(points_m, axis=0), np.ptp(points_m, axis=0)
    step_m = _step(extent, float(np.median(spacing)))
    axes = [low + step * np.arange(1 + round(length / step)) for low, step, length in zip(low_m, step_m, extent, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    out = np.empty((len(nodes), values.shape[1]))
    for begin in range(0, len(nodes), AT_ONCE):
        part = slice(begin, begin + AT_ONCE)
        away_m, nearest = tree.query(nodes[part], k=min(NEIGHBOURS, len(points_m)))
        out[part] = _fitted(points_m[nearest] - nodes[part, None], away_m, values[nearest])
        out[part][away_m[:, 0] > NEAR * spacing[nearest[:, 0]]] = 0.0
    return low_m, step_m, out.reshape(*(len(axis) for axis in axes), -1)


def _step(extent_m: Array, spacing_m: float) -> Array:
    """Equal steps (3,) [m] on every axis that divide it: the spacing of the mesh, or more if there would be too many nodes."""
    step = spacing_m
    while np.prod(1.0 + np.ceil(extent_m / step)) > MOST_NODES:
        step *= 1.1
    return np.where(extent_m > 0.0, extent_m / np.maximum(np.round(extent_m / step), 1.0), step)


def _fitted(offsets_m: Array, away_m: Array, values: Array) -> Array:
    """Linear fits (m, C) at nodes, from values (m, k, C) at offsets (m, k, 3); within the range of those values.

    A small ridge on the slopes keeps them 0 where the neighbours do not tell them, as across a mesh of one layer.
    """
    scale = np.mean(away_m, axis=1)[:, None]
    weight = 1.0 / ((away_m / scale) ** 2 + 0.01)
    design = np.concatenate([np.ones((*away_m.shape, 1)), offsets_m / scale[:, :, None]], axis=2)
    weighted = design * weight[:, :, None]
    normal = np.einsum("mki,mkj->mij", weighted, design)
    normal[:, range(1, 4), range(1, 4)] += 1e-6 * np.sum(weight, axis=1)[:, None]
    centre = np.linalg.solve(normal, np.einsum("mki,mkc->mic", weighted, values))[:, 0]
    return np.clip(centre, np.min(values, axis=1), np.max(values, axis=1))


def _numbered(folder: Path) -> list[Path]:
    """CSV files of a folder, by the number at the end of each name."""
    numbers = {p: re.search(r"(\d+)$", p.stem) for p in folder.glob("*.csv")}
    found = {int(match[1]): p for p, match in numbers.items() if match}
    if len(found) < len(numbers):
        raise bad_file(folder, "its CSV files are moments of one wind, so each name must end with a number of its own, as wind_0.csv")
    return [found[number] for number in sorted(found)]


def _read(path: Path) -> Array:
    """Places and wind (n, 6) [m, m/s]."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise bad_file(path, f"it is no text ({error})") from None
    for number, line in enumerate(lines[:HEADER_LINES]):
        delimiter = next((d for d in (",", ";", "\t") if d in line), None)
        columns = _columns(path, next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), []) if delimiter else line.split())
        if columns is None:
            continue
        try:
            body = [row for row in lines[number + 1 :] if row.strip()]
            rows = np.loadtxt(body, delimiter=delimiter, usecols=[i for i, _ in columns], ndmin=2) if body else np.empty((0, 6))
        except (ValueError, IndexError) as error:
            raise bad_file(path, f"below its header, line {number + 1}, there are not only numbers ({error})") from None
        return _checked(path, np.asarray(rows * [unit for _, unit in columns]))
    first = lines[0].strip()[:120] if lines else ""
    raise bad_file(path, f"no line names x, y, z and the wind u, v, w, as Points:0 and U:0 of ParaView do; the first is '{first}'")


def _checked(path: Path, rows: Array) -> Array:
    bad = int(np.sum(~np.all(np.isfinite(rows), axis=1)))
    if bad:
        raise bad_file(path, f"{bad} of {len(rows)} rows have values that are not finite; leave them out of the export")
    if len(rows) < NEIGHBOURS or not np.any(np.ptp(rows[:, :3], axis=0) > 0.0):
        raise bad_file(path, f"it has {len(rows)} rows at different places, but a wind needs {NEIGHBOURS} at least")
    return rows


def _columns(path: Path, header: list[str]) -> list[tuple[int, float]] | None:
    """Index and factor to m or m/s of x, y, z, u, v, w; None if this is not the line that names them."""
    names = [_name_and_unit(cell) for cell in header]
    found = [next((i for i, (name, _) in enumerate(names) if name in NAMES[wanted]), None) for wanted in NAMES]
    columns = [i for i in found if i is not None]
    if len(columns) < len(NAMES):
        return None
    kinds = ["length"] * 3 + ["speed"] * 3
    return [(i, factor(kind, names[i][1], f"{path}: column '{header[i]}'")) for i, kind in zip(columns, kinds, strict=True)]


def _name_and_unit(cell: str) -> tuple[str, str]:
    """Name in lower case, and unit: what is in the last brackets, unless it belongs to the name, as in `velocity[i]`."""
    name = cell.strip().strip('"').lower()
    split = re.fullmatch(r"(.+?)\s*[\[(]\s*([^\[\]()]*?)\s*[\])]", name)
    every = {spelling for spellings in NAMES.values() for spelling in spellings}
    if name in every or split is None:
        return name, "m" if name in {s for axis in "xyz" for s in NAMES[axis]} else "m/s"
    return split[1], split[2]
