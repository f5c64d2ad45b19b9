"""The paper's figure: nose track of the filter before and after calibration, seen from above, axes in mm."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from oio.core.records import Array
from oio.figures.geometry import ellipse, limits
from oio.figures.style import BELIEVED, CALIBRATED, DEAD, RC, SOURCE, TRUTH
from oio.results.tracks import Tracks

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PANELS = (("cold", "before calibration (cold start)", DEAD), ("calibrated", "after calibration", CALIBRATED))
SIZE_IN = (14.0, 7.6)
LEFTS, BOTTOM, WIDTH, HEIGHT = (0.06, 0.54), 0.16, 0.45, 0.76  # of the panels: fixed, to leave room for legend and titles
SHAPE = WIDTH * SIZE_IN[0] / (HEIGHT * SIZE_IN[1])  # width over height


def draw(tracks: Tracks, out: Path) -> None:
    """Draw two panels of equal scales; the track before the first map is cut at the limits of the axes. Writes the PNG `out`."""
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with mpl.rc_context(RC):
        figure = Figure(figsize=SIZE_IN, dpi=100)
        FigureCanvasAgg(figure)
        low, high = _limits(tracks)
        for left, (name, title, color) in zip(LEFTS, PANELS, strict=True):
            axes = figure.add_axes((left, BOTTOM, WIDTH, HEIGHT))
            axes.set_xlim(low[0], high[0])
            axes.set_ylim(low[1], high[1])
            _panel(axes, tracks, name, color)
            axes.set_title(f"{title}{_error(tracks, name)}", loc="left")
            axes.set_xlabel("x of the base frame (mm)")
            axes.tick_params(labelleft=left == LEFTS[0])
            axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.07), ncol=3, frameon=False, markerscale=0.7)
        figure.axes[0].set_ylabel("y of the base frame (mm)")
        figure.savefig(out, metadata={"Software": None})


def _panel(axes: "Axes", tracks: Tracks, name: str, color: str) -> None:
    axes.plot(*_mm(tracks.true_m).T, color=TRUTH, lw=3.0, label="true nose")
    axes.plot(*_mm(tracks.believed_m[name]).T, color=color, lw=1.0, label="nose, by the filter")
    if tracks.source_m is not None:
        axes.plot(*_mm(tracks.source_m), "*", ms=22, color=SOURCE, mec="black", ls="none", label="true source", zorder=5)
    if name in tracks.sources:
        mean, cov = tracks.sources[name]
        axes.plot(*_mm(mean), "X", ms=11, color=BELIEVED, mec="black", ls="none", label="believed source", zorder=7)
        axes.fill(*_mm(ellipse(mean, cov)).T, fc="none", ec=BELIEVED, lw=1.6, label="its 95 % region", zorder=4)


def _error(tracks: Tracks, name: str) -> str:
    if name not in tracks.sources or tracks.source_m is None:
        return ""
    return f": source {1e3 * float(np.linalg.norm(tracks.sources[name][0] - tracks.source_m)):.1f} mm off"


def _limits(tracks: Tracks) -> tuple[Array, Array]:
    """Limits of both panels: the truth since the first map, and those of the estimates that are not far from it."""
    since = len(tracks.true_m) - max(len(found) for found in tracks.believed_m.values())
    places = [] if tracks.source_m is None else [tracks.source_m[None, :]]
    core = np.concatenate([tracks.true_m[since:], *places, *([] if len(tracks.true_m) else [np.zeros((1, 3))])])
    rest = np.concatenate([core, *tracks.believed_m.values(), *(mean[None, :] for mean, _ in tracks.sources.values())])
    return limits(_mm(core), _mm(rest), SHAPE)


def _mm(p_m: Array) -> Array:
    return np.asarray(1e3 * p_m[..., :2])
