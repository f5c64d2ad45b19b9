"""The 3-D scene as a figure for paper: the traces that are shown at first, from one side."""

from typing import TYPE_CHECKING, Any

import numpy as np

from oio.core.records import Array
from oio.figures.style import TRUTH
from oio.report.captions import CAPTIONS
from oio.report.drawing import WIDE_IN, Drawing
from oio.report.scene_shapes import HIDDEN, Trace

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MARGIN_MM = 5.0
ELEVATION_DEG, AZIMUTH_DEG = 22.0, -60.0
SYMBOLS = {"circle": "o", "circle-open": "o", "diamond": "D", "square": "s", "x": "X"}  # plotly's names, matplotlib's letters


def scene_drawing(drawn: list[Trace]) -> Drawing:
    """Return the drawing of a scene: what the page shows before anything is clicked."""
    shown = [trace for trace in drawn if trace.get("visible", True) != HIDDEN]
    return Drawing("scene", (WIDE_IN, 5.8), CAPTIONS["scene"], lambda figure: _draw(figure, shown))


def _draw(figure: "Figure", traces: list[Trace]) -> None:
    axes: Any = figure.add_subplot(projection="3d", computed_zorder=False)  # else marks hide behind the spheres that are about them
    axes.view_init(ELEVATION_DEG, AZIMUTH_DEG)
    for order, trace in enumerate(traces):
        (_mesh if trace["type"] == "mesh3d" else _points)(axes, trace, order)
    points = np.concatenate([_xyz(trace) for trace in traces if len(_xyz(trace))])
    low, high = points.min(axis=0) - MARGIN_MM, points.max(axis=0) + MARGIN_MM  # flat scenes have a depth, too
    for limits, from_mm, to_mm in zip((axes.set_xlim, axes.set_ylim, axes.set_zlim), low, high, strict=True):
        limits(from_mm, to_mm)
    axes.set_box_aspect(high - low, zoom=0.85)  # room for the names of the axes, which the layout does not reckon with
    axes.locator_params(nbins=5)
    axes.set_xlabel("x, forward (mm)")
    axes.set_ylabel("y, to the left (mm)", labelpad=12.0)
    axes.set_zlabel("z, up (mm)")
    figure.legend(loc="outside upper left", ncols=2, frameon=False, markerscale=0.8)


def _points(axes: Any, trace: Trace, order: int) -> None:
    """A line, marks, or both; a trace without points is an entry of the legend."""
    xyz, line, marker = _xyz(trace), trace.get("line", {}), trace.get("marker", {})
    color = line.get("color", marker.get("color", TRUTH))
    style: dict[str, Any] = {
        "ls": "-" if "lines" in trace["mode"] else "none",
        "lw": 0.35 * line.get("width", 2),
        "alpha": trace.get("opacity", 1.0),
    }
    if "markers" in trace["mode"]:
        symbol = marker.get("symbol", "circle")
        style |= {"marker": SYMBOLS[symbol], "ms": marker["size"], "mfc": "none" if symbol.endswith("open") else marker.get("color", color)}
        style |= {"mec": "black" if marker.get("line") else color, "alpha": marker.get("opacity", 1.0)}
    label = trace["name"] if trace.get("showlegend", True) else None
    axes.plot(*(xyz if len(xyz) else np.full((1, 3), np.nan)).T, color=color, label=label, zorder=order + 1000 * len(xyz[:1]), **style)


def _mesh(axes: Any, trace: Trace, order: int) -> None:
    corners, style = np.stack([trace[name] for name in "ijk"], axis=1), {"color": trace["color"], "alpha": 0.5 * trace["opacity"]}
    faces = axes.plot_trisurf(*_xyz(trace).T, triangles=corners, lw=0, shade=False, zorder=order, **style)
    faces.set_rasterized(True)  # hundreds of triangles each: as a picture they are a tenth of the bytes


def _xyz(trace: Trace) -> Array:
    """Points of a trace in mm, (k, 3); (0, 3) where it has none."""
    found = np.array([trace[name] for name in "xyz"], dtype=float).T
    return found[np.all(np.isfinite(found), axis=1)]
