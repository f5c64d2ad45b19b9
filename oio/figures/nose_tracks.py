"""The nose before and after calibration: its distance from the truth, and the error per axis, with 95 % bounds, in mm."""

from typing import TYPE_CHECKING, Any

import numpy as np

from oio.core.records import Array
from oio.figures.error_timelines import nose_error
from oio.figures.run_history import RunHistory
from oio.figures.style import CALIBRATED, DEAD, VARIANTS
from oio.figures.timelines import TIME, say, thinned
from oio.figures.track import TrackOverTime

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEAST_MM = 1.0  # half of the height of a panel
TWO_SIDED_95 = 1.96  # standard deviations
BESIDE = "cold_open"  # the cold start whose stated uncertainty is of the order of its error; the other's is next to nothing


def nose_tracks(figure: "Figure", story: RunHistory, summary: dict[str, Any]) -> None:
    """Plot the distance of every estimate, and below it the errors along x, y and z with their bands; without a truth the distance
    from the calibrated filter."""
    top, *panels = figure.subplots(4, 1, sharex=True, height_ratios=[1.7, 1.0, 1.0, 1.0])
    nose_error(top, story, summary)
    top.set_xlabel("")
    against = story.truth if len(story.truth) else story.odometry
    for axis, axes in enumerate(panels):
        axes.set_ylabel(f"{'xyz'[axis]} (mm)")
        if not len(against):
            say(axes, "no truth and no belief in this log")
            continue
        for track, color in _tracks(story):
            _error(axes, track, against, axis, color)
        low, high = axes.get_ylim()
        axes.set_ylim(min(low, -LEAST_MM), max(high, LEAST_MM))
    panels[-1].set_xlabel(TIME)


def _tracks(story: RunHistory) -> list[tuple[TrackOverTime, str]]:
    cold = [(story.others[BESIDE].nose, VARIANTS[BESIDE][1])] if BESIDE in story.others else []
    return [(story.dead, DEAD), *cold, (story.odometry, CALIBRATED)]


def _error(axes: Any, track: TrackOverTime, against: TrackOverTime, axis: int, color: str) -> None:
    t_s, own, other = track.matched(against)
    every = thinned(t_s)
    t_s, own, other = t_s[every], own[every], other[every]
    error_mm: Array = 1e3 * (track.p_m[own, axis] - against.p_m[other, axis])
    axes.plot(t_s, error_mm, color=color, lw=1.3)
    half_mm = 1e3 * TWO_SIDED_95 * np.sqrt(np.maximum(track.cov_m2[own, axis, axis], 0.0))
    if np.any(half_mm > 0.0):
        axes.fill_between(t_s, error_mm - half_mm, error_mm + half_mm, color=color, alpha=0.18, lw=0)
