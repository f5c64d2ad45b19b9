"""Shapes of the 3-D scene as traces of plotly.js (https://plotly.com/javascript/reference): lines, marks, ellipsoids. Lengths in mm."""

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from oio.core.records import Array
from oio.inference.metrics import CHI2_95

Trace = dict[str, Any]
HIDDEN = "legendonly"  # at first: an entry of the legend shows it
MOST = 600  # points of a line
MERIDIANS, PARALLELS = 20, 11  # of an ellipsoid


def line(p_m: Array, name: str, color: str, width: int, visible: object = True) -> Trace:
    """A line through (k, 3) m, thinned."""
    x, y, z = _mm(p_m[:: max(1, len(p_m) // MOST)])
    return {
        "type": "scatter3d", "mode": "lines", "x": x, "y": y, "z": z, "name": name, "opacity": 0.7,
        "line": {"color": color, "width": width}, "visible": visible,
    }  # fmt: skip


def mark(p_m: Array, name: str, color: str, symbol: str, visible: object = True) -> Trace:
    """A mark at (3,) m, or several at (k, 3) m."""
    x, y, z = _mm(np.atleast_2d(p_m))
    marker = {"size": 6, "color": color, "symbol": symbol, "line": {"color": "black", "width": 1}}
    return {"type": "scatter3d", "mode": "markers", "x": x, "y": y, "z": z, "name": name, "marker": marker, "visible": visible}


def regions_95(places: Sequence[tuple[Array, Array]], name: str, color: str, opacity: float, visible: object = True) -> Trace:
    """95 % regions of places, each of mean (3,) m and covariance (3, 3) m^2."""
    found = []
    for mean, cov in places:
        values, axes = np.linalg.eigh(cov)
        found.append((mean, axes * np.sqrt(CHI2_95[3] * np.maximum(values, 0.0))))
    return ellipsoids(found, name, color, opacity, visible)


def ellipsoids(shapes: Sequence[tuple[Array, Array]], name: str, color: str, opacity: float, visible: object = True) -> Trace:
    """Ellipsoids as one mesh: of each the centre (3,) m and the half axes as columns (3, 3) m."""
    ball, faces = _ball()
    x, y, z = _mm(np.concatenate([centre + ball @ axes.T for centre, axes in shapes]))
    corners = np.concatenate([faces + n * len(ball) for n in range(len(shapes))])
    i, j, k = (corners[:, n].tolist() for n in range(3))
    return {
        "type": "mesh3d", "x": x, "y": y, "z": z, "i": i, "j": j, "k": k, "color": color, "opacity": opacity, "hoverinfo": "name",
        "name": name, "visible": visible,
    }  # fmt: skip


def entry(name: str, color: str, visible: object = True) -> Trace:
    """What stands in the legend for a mesh, which has no symbol of its own there."""
    marker = {"size": 10, "color": color, "opacity": 0.4, "symbol": "circle"}
    nowhere = {"x": [None], "y": [None], "z": [None]}
    return {"type": "scatter3d", "mode": "markers", **nowhere, "marker": marker, "name": name, "visible": visible}


def grouped(name: str, shown: Trace, *with_it: Trace) -> list[Trace]:
    """Traces that one entry of the legend, that of `shown`, shows and hides together."""
    return [{**shown, "name": name, "legendgroup": name}, *({**one, "legendgroup": name, "showlegend": False} for one in with_it)]


def _mm(p_m: Array) -> list[list[float]]:
    return [np.round(1e3 * p_m[:, i], 1).tolist() for i in range(3)]


@functools.cache
def _ball() -> tuple[Array, Array]:
    """The unit sphere: points (n, 3) and triangles (m, 3) of their numbers."""
    polar = np.linspace(0.0, np.pi, PARALLELS)[1:-1]
    turn = np.linspace(0.0, 2.0 * np.pi, MERIDIANS, endpoint=False)
    rings = [(np.sin(p) * np.cos(t), np.sin(p) * np.sin(t), np.cos(p)) for p in polar for t in turn]
    points = np.array([*rings, (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)])
    top, bottom, last = len(rings), len(rings) + 1, len(rings) - MERIDIANS
    faces = []
    for t in range(MERIDIANS):
        after = (t + 1) % MERIDIANS
        faces += [(top, t, after), (bottom, last + after, last + t)]
        for ring in range(0, last, MERIDIANS):
            a, b, c, d = ring + t, ring + after, ring + MERIDIANS + t, ring + MERIDIANS + after
            faces += [(a, c, b), (b, c, d)]
    return points, np.array(faces)
