"""Gas readings over the whole run, with the stages named above them."""

from typing import TYPE_CHECKING

import numpy as np

from oio.core.records import Array, seconds
from oio.figures.geometry import rows
from oio.figures.run_history import RunHistory
from oio.figures.style import ELEMENTS, SHADES
from oio.figures.timelines import TIME, legend_above, say

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NAME_POINTS = 9.0  # size of the names of stages
POINTS_PER_INCH = 72.0


def gas(axes: "Axes", story: RunHistory, columns: int = 4) -> None:
    """Plot the readings per element over the whole run, stages shaded."""
    axes.set_title("Gas readings", loc="left")
    if not story.readings:
        say(axes, "no reading in this log")
        return
    t_s = np.array([seconds(r.t_ns) for r in story.readings])
    element, ppm = np.array([r.element for r in story.readings]), np.array([r.ppm for r in story.readings])
    for e in np.unique(element):
        selected, color = element == e, ELEMENTS[int(e) % len(ELEMENTS)]
        axes.plot(t_s[selected], ppm[selected], color=color, lw=1.1, label=f"element {e}")
    end_s = max([1.0, float(t_s[-1]), *(span.end_s for span in story.spans)])
    axes.set_xlim(0.0, end_s)
    axes.set_ylabel("reading (ppm)")
    axes.set_xlabel(TIME)
    _stages(axes, story, _axis_range(ppm))
    legend_above(axes, columns)


def _stages(axes: "Axes", story: RunHistory, spread: tuple[float, float]) -> None:
    """Shade the stages and name each from where it begins, in rows above the data; a stage without simulated time cannot be seen."""
    low, high = spread
    visible = [span for span in story.spans if span.end_s > span.begin_s]
    names = [span.stage.replace("_", " ") for span in visible]
    widths = [_width_s(axes, name) for name in names]
    end_s = axes.get_xlim()[1]
    lefts = [max(min(span.begin_s, end_s - width), 0.0) for span, width in zip(visible, widths, strict=True)]
    levels = rows([left + 0.5 * width for left, width in zip(lefts, widths, strict=True)], widths)
    row_height = 0.11 * (high - low)  # of a row of names
    axes.set_ylim(low, high + row_height * (1 + max(levels, default=-1)))
    for i, (span, name, level, left) in enumerate(zip(visible, names, levels, lefts, strict=True)):
        axes.axvspan(span.begin_s, span.end_s, color=SHADES[i % 2], lw=0, zorder=0)
        y = high + row_height * (level + 0.5)
        axes.annotate(name, (left, y), (3.0, 0.0), textcoords="offset points", ha="left", va="center", fontsize=NAME_POINTS)


def _width_s(axes: "Axes", name: str) -> float:
    """Width of a name in seconds of the axis, at least: a letter of sans serif is on average some 0.55 of its size wide."""
    low, high = axes.get_xlim()
    figure = axes.get_figure(root=True)
    assert figure is not None
    width_points = axes.get_window_extent().width * POINTS_PER_INCH / figure.dpi
    return (0.62 * NAME_POINTS * len(name) + 8.0) * (high - low) / width_points


def _axis_range(ppm: Array) -> tuple[float, float]:
    finite = ppm[np.isfinite(ppm)]
    low, high = (float(np.min(finite)), float(np.max(finite))) if len(finite) else (0.0, 1.0)
    margin = 0.05 * (high - low) or 1.0
    return low - margin, high + margin
