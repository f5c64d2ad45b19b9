"""The region of the source, magnified, in the corner of the view from above that has the least in it."""

from typing import TYPE_CHECKING

import numpy as np

from oio.core.records import Array
from oio.figures.geometry import ellipse
from oio.figures.run_history import RunHistory
from oio.figures.style import BELIEVED, SOURCE, TRUTH, VARIANTS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIZE = 0.37  # of the panel's shorter side
WORTH = 5.0  # least magnification
MARGIN = 1.25  # of the region that is shown over that of its content
LEAST_MM = 4.0  # half a side
GAP = 0.035  # to the edges of the panel, in units of it, beside which there are the labels of the inset
PLACE_WORTH = 50  # points of a track
NEAR = 4.0  # what is further off than so many half sides is not shown: a cold start may be anywhere


def source_inset(axes: "Axes", story: RunHistory, low: Array, high: Array) -> None:
    """Draw the magnified region with the 95 % regions of all filters, if it is small in a panel with limits low, high (2,) mm."""
    if not len(story.source):
        return
    box = axes.get_window_extent()
    side = SIZE * min(box.width, box.height)
    share = np.array([side / box.width, side / box.height])
    largest_mm = 0.5 * float(share[0] * (high - low)[0]) / WORTH
    centre, half_mm = _window(story, largest_mm)
    if half_mm > largest_mm or not np.all((centre > low) & (centre < high)):
        return
    corner = _corner(axes, story, share, low, high)
    inset = axes.inset_axes((*corner, *share), zorder=8)
    inset.set_xlim(centre[0] - half_mm, centre[0] + half_mm)
    inset.set_ylim(centre[1] - half_mm, centre[1] + half_mm)
    _content(inset, story)
    inset.tick_params(labelsize=8, pad=1.5, length=2)
    inset.locator_params(nbins=4)
    inset.set_title("around the source (mm)", fontsize=9, weight="normal", pad=3.0)
    for spine in inset.spines.values():
        spine.set_visible(True)
        spine.set_color("#555555")
    axes.indicate_inset_zoom(inset, edgecolor="#555555", alpha=0.8)


def _window(story: RunHistory, largest_mm: float) -> tuple[Array, float]:
    """Centre (2,) mm and half a side [mm]: what is true and what is believed, and the cold starts if they are near, and leave
    it at no more than `largest_mm`."""
    found = [
        _mm(ellipse(story.source.p_m[-1], story.source.cov_m2[-1])),
        *([_mm(story.places["source"])[None]] if "source" in story.places else []),
    ]
    half = _half(np.concatenate(found))
    for name in VARIANTS:
        if name in story.others and len(story.others[name].source):
            beside = _mm(story.others[name].source.p_m[-1])[None]
            if _half(np.concatenate([*found, beside])) < min(NEAR * max(half, LEAST_MM), largest_mm / MARGIN):
                found.append(beside)
    points = np.concatenate(found)
    return 0.5 * (points.min(axis=0) + points.max(axis=0)), MARGIN * max(_half(points), LEAST_MM)


def _half(points: Array) -> float:
    return 0.5 * float(np.max(points.max(axis=0) - points.min(axis=0)))


def _content(inset: "Axes", story: RunHistory) -> None:
    if len(story.truth):
        inset.plot(*_mm(story.truth.p_m).T, color=TRUTH, lw=0.8, alpha=0.5)
    for name, (_, color) in VARIANTS.items():
        if name in story.others and len(story.others[name].source):
            last = story.others[name].source
            inset.plot(*_mm(ellipse(last.p_m[-1], last.cov_m2[-1])).T, color=color, lw=1.5)
            inset.plot(*_mm(last.p_m[-1]), "P", ms=7, color=color, mec="black", mew=0.6)
    mean, cov = story.source.p_m[-1], story.source.cov_m2[-1]
    inset.fill(*_mm(ellipse(mean, cov)).T, fc=BELIEVED, ec="none", alpha=0.3)
    inset.plot(*_mm(ellipse(mean, cov)).T, color=BELIEVED, lw=1.6)
    inset.plot(*_mm(mean), "X", ms=8, color=BELIEVED, mec="black", mew=0.6)
    if "source" in story.places:
        inset.plot(*_mm(story.places["source"]), "*", ms=12, color=SOURCE, mec="black", mew=0.6)


def _corner(axes: "Axes", story: RunHistory, share: Array, low: Array, high: Array) -> tuple[float, float]:
    """The corner with the least in it, in units of the panel: points of tracks, and places, which are worth more."""
    tracks = [_mm(p) for p in (story.truth.p_m, story.odometry.p_m, story.dead.p_m)]
    places = np.repeat(_mm(np.array([*story.places.values(), np.zeros(3)])), PLACE_WORTH, axis=0)
    inside = (np.concatenate([*tracks, places]) - low) / (high - low)
    corners = [(x, y) for y in (1.0 - share[1] - 2.0 * GAP, GAP + 0.02) for x in (1.0 - share[0] - GAP, GAP + 0.045)]
    counts = [int(np.sum(np.all((inside > np.array(c) - GAP) & (inside < np.array(c) + share + GAP), axis=1))) for c in corners]
    return corners[counts.index(min(counts))]


def _mm(p_m: Array) -> Array:
    return np.asarray(1e3 * p_m[..., :2])
