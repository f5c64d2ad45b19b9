"""Main panel: the search seen from above."""

from typing import TYPE_CHECKING, Any

import numpy as np

from oio.core.records import Array
from oio.figures.geometry import ellipse, limits
from oio.figures.run_history import RunHistory
from oio.figures.source_inset import source_inset
from oio.figures.style import BEACON, BELIEVED, CALIBRATED, DEAD, SOURCE, TRUTH, VARIANTS
from oio.figures.timelines import legend_above
from oio.figures.track import TrackOverTime

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHOWN = tuple((name, VARIANTS[name]) for name in ("cold",))  # the tangle of a search bears no more lines


def search_map(axes: "Axes", story: RunHistory, columns: int = 2) -> None:
    """Draw nose tracks, source positions and the final belief; x and y of the base frame in mm, equal scales."""
    low, high = _show(axes, story)
    _tracks(axes, story)
    _places(axes, story)
    _belief(axes, story, low, high)
    what = "search" if story.search.stage else "run"
    axes.set_title(f"The {what} seen from above" + ("" if len(story.truth) else "; no truth in this log: beliefs only"), loc="left")
    axes.set_xlabel("x of the base frame, forward (mm)")
    axes.set_ylabel("y of the base frame, to the left (mm)")
    legend_above(axes, columns)
    figure = axes.get_figure(root=True)
    if figure is not None and figure.get_layout_engine() is not None:
        figure.draw_without_rendering()  # now the panel has its size, on which equal scales depend
    source_inset(axes, story, *_show(axes, story))


def _show(axes: "Axes", story: RunHistory) -> tuple[Array, Array]:
    low, high = _limits(axes, story)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    return low, high


def _tracks(axes: "Axes", story: RunHistory) -> None:
    lines: tuple[tuple[TrackOverTime, str, dict[str, Any]], ...] = (
        (story.dead, "nose, encoders alone", {"color": DEAD, "lw": 0.9, "alpha": 0.8}),
        (story.truth, "true nose", {"color": TRUTH, "lw": 2.2}),
        *(
            (story.others[name].nose, f"nose, {label}", {"color": color, "lw": 0.8})
            for name, (label, color) in SHOWN
            if name in story.others
        ),
        (story.odometry, "nose, calibrated", {"color": CALIBRATED, "lw": 0.8, "marker": ".", "ms": 3}),
    )
    for course, label, style in lines:
        if len(course):
            axes.plot(*_mm(course.p_m).T, label=label, **style)


def _places(axes: "Axes", story: RunHistory) -> None:
    axes.plot(0, 0, "s", ms=9, color="black", label="arm base", ls="none")
    marks: tuple[tuple[str, str, dict[str, Any]], ...] = (
        ("beacon", "beacon (known place)", {"marker": "^", "ms": 9, "color": BEACON}),
        ("source", "true source", {"marker": "*", "ms": 15, "color": SOURCE}),
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
    label = "source, calibrated" if inside else f"source, calibrated: at ({at[0]:.0f}, {at[1]:.0f}) mm"
    axes.plot(*at, "X", ms=8, color=BELIEVED, mec="black", label=label, ls="none", zorder=7)
    axes.fill(*_mm(ellipse(mean, cov)).T, fc=(*_rgb(BELIEVED), 0.35), ec=BELIEVED, lw=1.6, label="its 95 % region", zorder=6)
    for i, (other, spread) in enumerate(story.left[1:]):
        axes.plot(
            *_mm(ellipse(other, spread)).T, color=BELIEVED, lw=1.0, ls="--", label=f"{len(story.left) - 1} other places" if i == 0 else None
        )
    for name, (words, color) in VARIANTS.items():
        if name in story.others and len(story.others[name].source):
            axes.plot(
                *_mm(story.others[name].source.p_m[-1]), "P", ms=6, color=color, mec="black", mew=0.6, label=f"source, {words}", ls="none"
            )


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
