"""Picture of a location: path of the nose with what it sensed, and the 95 % regions of the source, from above and from the side."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from oio.api.location import Location
from oio.api.samples import NosePath
from oio.core.records import Array
from oio.figures.geometry import ellipse
from oio.figures.style import BELIEVED, RC, SOURCE
from oio.localise.found import Found

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIZE_IN, DPI = (13.0, 6.5), 100
VIEWS = (("from above", 0, 1), ("from the side", 0, 2))  # axes of the frame, to the right and up


def draw(found: Found, where: Location, out: Path) -> None:
    """Draw a location to a PNG; the same location gives the same bytes."""
    import matplotlib as mpl  # here: the import takes a second, and bad input is refused without
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    nose_m, ppm = _sensed(found)
    with mpl.rc_context(RC):
        figure = Figure(figsize=SIZE_IN, dpi=DPI, layout="constrained")
        FigureCanvasAgg(figure)
        panels = figure.subplots(1, len(VIEWS))
        for axes, (title, right, up) in zip(panels, VIEWS, strict=True):
            shades = axes.scatter(*1e3 * nose_m[:, [right, up]].T, c=ppm, cmap="cividis", s=14, label="nose, at its readings")
            _regions(axes, where, right, up)
            axes.set_aspect("equal", adjustable="datalim")
            axes.set_title(title, loc="left")
            axes.set_xlabel(f"{'xyz'[right]} (mm)")
            axes.set_ylabel(f"{'xyz'[up]} (mm)")
        figure.colorbar(shades, ax=panels, label="reading (ppm)")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower left", ncols=3)
        figure.suptitle(f"Source {1e3 * where.sd_m:.0f} mm uncertain, verdict {where.verdict}", x=0.01, ha="left", weight="bold")
        figure.savefig(out, metadata={"Software": None})


def _regions(axes: "Axes", where: Location, right: int, up: int) -> None:
    """The best place, then all others that explain the readings."""
    pair = [right, up]
    for number, (mean_m, cov_m2) in enumerate(((where.mean_m, where.cov_m2), *where.others)):
        outline = 1e3 * ellipse(mean_m[pair], cov_m2[np.ix_(pair, pair)])
        best = number == 0
        axes.fill(*outline.T, facecolor=BELIEVED if best else "none", edgecolor=BELIEVED, alpha=0.5 if best else 0.8)
        label = ("source, with its 95 % region" if best else "another place that explains the readings") if number < 2 else None
        axes.plot(
            *1e3 * mean_m[pair], marker="*" if best else "x", color=SOURCE if best else BELIEVED, mec="black", ms=14, ls="", label=label
        )


def _sensed(found: Found) -> tuple[Array, Array]:
    """Places of the nose (m, 3) [m] at the readings of the search, and those (m,) [ppm]."""
    readings = found.readings
    assert readings is not None
    t_s = np.asarray(readings.t_s)
    q = np.stack([np.interp(t_s, np.asarray(found.path.t_s), joint) for joint in np.asarray(found.path.q).T], axis=1)
    nose_m = q if isinstance(found.path, NosePath) else found.setup.robot.nose(q)
    return nose_m, np.asarray(readings.ppm)
