"""Main panel: the search seen from above."""

from typing import TYPE_CHECKING, Any

import numpy as np

from oio.core.records import Array
from oio.figures.geometry import ellipse, limits
from oio.figures.run_history import RunHistory, TrackOverTime
from oio.figures.style import BEACON, BELIEVED, CALIBRATED, DEAD, SOURCE, TRUTH

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def search_map(axes: "Axes", story: RunHistory) -> None:
    """Draw nose tracks, source positions and the final belief; x and y of the base frame in mm, equal scales."""
    low, high = _limits(axes, story)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    _tracks(axes, story)
    _places(axes, story)
    _belief(axes, story, low, high)
    what = "search" if story.search.stage else "run"
    axes.set_title(f"The {what} seen from above" + ("" if len(story.truth) else "; no truth in this log: beliefs only"), loc="left")
    axes.set_xlabel("x of the base frame, forward (mm)")
    axes.set_ylabel("y of the base frame, to the left (mm)")
    axes.legend(loc="upper left", bbox_to_anchor=(-0.06, -0.085), ncol=2, frameon=False, markerscale=0.65)


def _tracks(axes: "Axes", story: RunHistory) -> None:
    lines: tuple[tuple[TrackOverTime, str, dict[str, Any]], ...] = (
        (story.dead, "nose by dead reckoning (encoders alone)", {"color": DEAD, "lw": 1.0, "alpha": 0.8}),
        (story.truth, "true nose", {"color": TRUTH, "lw": 2.6}),
        (story.odometry, "nose as believed (calibrated)", {"color": CALIBRATED, "lw": 0.9, "marker": ".", "ms": 4}),
    )
    for course, label, style in lines:
        if len(course):
            axes.plot(*_mm(course.p_m).T, label=label, **style)


def _places(axes: "Axes", story: RunHistory) -> None:
    axes.plot(0, 0, "s", ms=13, color="black", label="arm base", ls="none")
    marks: tuple[tuple[str, str, dict[str, Any]], ...] = (
        ("beacon", "beacon (calibration)", {"marker": "^", "ms": 12, "color": BEACON}),
        ("source", "true source", {"marker": "*", "ms": 24, "color": SOURCE}),
    )
    for place, label, style in marks:
        if place in story.places:
            axes.plot(*_mm(story.places[place]), label=label, ls="none", mec="black", zorder=5, **style)


def _belief(axes: "Axes", story: RunHistory, low: Array, high: Array) -> None:
    """Final believed source with its 95 % ellipse; if outside the panel, its position is in the legend."""
    if not len(story.source):
        return
    mean, cov = story.source.p_m[-1], story.source.cov_m2[-1]
    at = _mm(mean)
    inside = bool(np.all((at >= low) & (at <= high)))
    label = "believed source" if inside else f"believed source: outside, at ({at[0]:.0f}, {at[1]:.0f}) mm"
    axes.plot(*at, "X", ms=11, color=BELIEVED, mec="black", label=label, ls="none", zorder=7)
    axes.fill(*_mm(ellipse(mean, cov)).T, fc=(*_rgb(BELIEVED), 0.35), ec=BELIEVED, lw=2.0, label="its 95 % region", zorder=6)


def _limits(axes: "Axes", story: RunHistory) -> tuple[Array, Array]:
    tracks = [story.truth.p_m, story.odometry.p_m] if len(story.truth) else [story.odometry.p_m, story.dead.p_m]
    core = np.concatenate([np.zeros((1, 3)), *tracks[:1], *(p[None, :] for p in story.places.values())])
    rest = [_mm(p) for p in (*tracks[1:], story.dead.p_m)]
    if len(story.source):
        rest.append(_mm(ellipse(story.source.p_m[-1], story.source.cov_m2[-1])))
    box = axes.get_window_extent()
    return limits(_mm(core), np.concatenate(rest), box.width / box.height)


def _mm(p_m: Array) -> Array:
    return np.asarray(1e3 * p_m[..., :2])


def _rgb(color: str) -> tuple[float, float, float]:
    r, g, b = (int(color[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return r, g, b
