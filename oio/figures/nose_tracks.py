"""The nose before and after calibration: what the encoders alone say and what the calibrated filter says, per axis in mm."""

from typing import TYPE_CHECKING

import numpy as np

from oio.figures.run_history import RunHistory, TrackOverTime
from oio.figures.style import CALIBRATED, DEAD
from oio.figures.timelines import TIME, say

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST = 800  # points of a line


def nose_tracks(figure: "Figure", story: RunHistory) -> None:
    """Plot the error of both per axis, against the truth where there is one; else how far they are apart. Bands are 95 % (2 sigma)."""
    panels = figure.subplots(3, 1, sharex=True)
    against = story.truth if len(story.truth) else story.odometry
    for axis, axes in enumerate(panels):
        if not len(against) or not len(story.odometry):
            say(axes, "no belief in this log")
            continue
        for track, label, color in ((story.dead, "encoders alone", DEAD), (story.odometry, "calibrated filter", CALIBRATED)):
            if track is against and not len(story.truth):
                axes.axhline(0.0, color=color, lw=1.2, label=label)
                _band(axes, track, axis, np.zeros(len(track)), color)
                continue
            t_s, own, other = np.intersect1d(track.t_s, against.t_s, return_indices=True)
            every = max(1, len(t_s) // MOST)
            error_mm = 1e3 * (track.p_m[own, axis] - against.p_m[other, axis])
            axes.plot(t_s[::every], error_mm[::every], color=color, lw=1.2, label=label)
            if track is story.odometry:
                _band(axes, track, axis, np.interp(track.t_s, t_s, error_mm) if len(t_s) else np.zeros(len(track)), color)
        axes.set_ylabel(f"{'xyz'[axis]} error (mm)" if len(story.truth) else f"{'xyz'[axis]} (mm)")
    what = "Nose error" if len(story.truth) else "Nose by the encoders alone, relative to the calibrated filter (no truth in this log)"
    panels[0].set_title(f"{what}; the band is the filter's 95 %", loc="left")
    if panels[0].lines:
        panels[0].legend(loc="upper left", ncol=2, fontsize=9)
    panels[-1].set_xlabel(TIME)


def _band(axes: "object", track: TrackOverTime, axis: int, middle_mm: np.ndarray, color: str) -> None:
    spread = 2e3 * np.sqrt(np.maximum(track.cov_m2[:, axis, axis], 0.0))
    axes.fill_between(track.t_s, middle_mm - spread, middle_mm + spread, color=color, alpha=0.15, lw=0)  # type: ignore[attr-defined]
