"""Time-series panels: source error, gas readings and nose error."""

from typing import TYPE_CHECKING

import numpy as np

from oio.core.records import Array, seconds
from oio.figures.geometry import rows, source_errors
from oio.figures.run_history import RunHistory
from oio.figures.style import CALIBRATED, DEAD, ELEMENTS, SHADES
from oio.figures.titles import Document, number

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TIME = "time since the run began (s)"


def source_error(axes: "Axes", story: RunHistory) -> None:
    """Plot |believed - true| over the search, log scale, with two standard deviations of the belief."""
    axes.set_title("Source error" if story.dof >= 3 else "Error of the source's bearing", loc="left")
    if "source" not in story.places or not len(story.source):
        say(axes, "no truth in this log: the error is unknown" if len(story.source) else "no belief in this log: nothing was mapped")
        return
    error, two_sigma, unit = source_errors(story)
    t_s, floor = story.source.t_s, 0.5 * max(float(np.min(error)), 0.2)
    axes.fill_between(
        t_s, floor, np.maximum(two_sigma, floor), color=CALIBRATED, alpha=0.18, lw=0, label="within 2 $\\sigma$ of the belief"
    )
    axes.plot(t_s, np.maximum(error, floor), color=CALIBRATED, lw=1.6, label="|believed $-$ true|")
    axes.set_yscale("log")
    axes.set_ylim(floor, 1.5 * float(np.max([error, two_sigma])))
    axes.set_yticks(_ticks(*axes.get_ylim()))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.minorticks_off()
    axes.set_ylabel(f"error ({unit})")
    _search_axis(axes, story)
    _exploration_label(axes, story, float(t_s[0]))


def _ticks(low: float, high: float) -> list[float]:
    """Tick positions: 1, 2 and 5 of every decade; fewer over three decades and more, more within one."""
    steps = (1.0,) if high > 1e3 * low else (1.0, 2.0, 5.0) if high > 10 * low else (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)
    ticks = [step * 10.0**decade for decade in range(-6, 7) for step in steps]
    return [tick for tick in ticks if low <= tick <= high]


def gas(axes: "Axes", story: RunHistory) -> None:
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
    _legend(axes)


def nose_error(axes: "Axes", story: RunHistory, summary: Document) -> None:
    """Plot the nose position error of the calibrated filter and of dead reckoning."""
    axes.set_title("Nose error", loc="left")
    if not len(story.truth):
        say(axes, "no truth in this log: the error is unknown")
        return
    for course, label, keys, color in (
        (story.dead, "dead reckoning", ("dead_reckoning", "nose_error_m"), DEAD),
        (story.odometry, "calibrated odometry", ("calibrated", "nose_error_m"), CALIBRATED),
    ):
        if len(course):
            t_s, off_m = course.distances(story.truth)
            rms_m = number(summary, *keys)
            label += "" if rms_m is None else f", RMS {1e3 * rms_m:.1f} mm"
            axes.plot(t_s, 1e3 * off_m, color=color, lw=1.3, label=label)
        elif course is story.dead:
            axes.plot([], [], color=color, label="no dead reckoning: no arm.mjcf fits this log")
    axes.set_ylim(bottom=0.0)
    axes.set_ylabel("error (mm)")
    _search_axis(axes, story, "; RMS since the first map" if summary else "")


def say(axes: "Axes", text: str) -> None:
    """Leave a panel empty but for a text that gives the reason."""
    axes.set_xticks([])
    axes.set_yticks([])
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center")


def _search_axis(axes: "Axes", story: RunHistory, more: str = "") -> None:
    axes.set_xlim(story.search.begin_s, max(story.search.end_s, story.search.begin_s + 1.0))
    axes.set_xlabel(TIME + ("; the search only" if story.search.stage else "") + more)
    _legend(axes)


def _legend(axes: "Axes") -> None:
    axes.legend(
        loc="lower right", bbox_to_anchor=(1.01, 0.98), ncol=4, frameon=False, borderaxespad=0.0, handlelength=1.3, columnspacing=1.2
    )


def _exploration_label(axes: "Axes", story: RunHistory, until_s: float) -> None:
    begin_s, end_s = story.search.begin_s, story.search.end_s
    if until_s - begin_s > 0.2 * (end_s - begin_s):
        middle = 0.5 * (until_s - begin_s) / (end_s - begin_s)
        axes.text(middle, 0.5, "exploring:\nno belief yet", transform=axes.transAxes, ha="center", va="center", color="#666666")


def _stages(axes: "Axes", story: RunHistory, spread: tuple[float, float]) -> None:
    """Shade the stages and label them in rows above the data; a stage without simulated time cannot be seen."""
    low, high = spread
    visible = [span for span in story.spans if span.end_s > span.begin_s]
    names = [span.stage.replace("_", " ") for span in visible]
    widths = [_width_s(axes, name) for name in names]
    middles = [max(0.5 * (span.begin_s + span.end_s), 0.5 * width) for span, width in zip(visible, widths, strict=True)]
    levels = rows(middles, widths)
    row_height = 0.13 * (high - low)  # of a row of names
    axes.set_ylim(low, high + row_height * (1 + max(levels, default=-1)))
    for i, (span, name, level) in enumerate(zip(visible, names, levels, strict=True)):
        axes.axvspan(span.begin_s, span.end_s, color=SHADES[i % 2], lw=0, zorder=0)
        axes.text(middles[i], high + row_height * (level + 0.5), name, ha="center", va="center", fontsize=10)


def _width_s(axes: "Axes", name: str) -> float:
    """Width of a label in seconds of the axis, about: letters of 10 points are some 8 pixels wide."""
    low, high = axes.get_xlim()
    return (8 * len(name) + 12) * (high - low) / axes.get_window_extent().width


def _axis_range(ppm: Array) -> tuple[float, float]:
    finite = ppm[np.isfinite(ppm)]
    low, high = (float(np.min(finite)), float(np.max(finite))) if len(finite) else (0.0, 1.0)
    margin = 0.05 * (high - low) or 1.0
    return low - margin, high + margin
