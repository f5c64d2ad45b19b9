"""Errors of source and nose over the search: by the calibrated filter, the cold starts and the encoders alone, with bounds."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from oio.core.records import Array
from oio.figures.geometry import radii_95, source_errors
from oio.figures.run_history import RunHistory
from oio.figures.style import CALIBRATED, DEAD, VARIANTS
from oio.figures.timelines import error_limits, error_scale, legend_above, say, search_axis, thinned
from oio.figures.titles import Document, number
from oio.figures.track import TrackOverTime

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SMALLEST = 0.5  # mm, or degrees: smaller errors are drawn as that
SMALLEST_RATIO = 0.05  # of an error to its bound
Row = tuple[str, str, Array, Array, Array | None]  # label, colour, t_s (k,), error (k,), 95 % bound (k,), None for no bound


def source_error(axes: "Axes", story: RunHistory, columns: int = 2) -> None:
    """Plot |believed - true| over the search, log scale, of all filters, with the bound below which 95 % lie by each belief."""
    axes.set_title("Source error" if story.dof >= 3 else "Error of the source's bearing", loc="left")
    if "source" not in story.places or not len(story.source):
        say(axes, "no truth in this log: the error is unknown" if len(story.source) else "no belief in this log: nothing was mapped")
        return
    rows, unit = list[Row](), "mm"
    for track, label, color in (*_cold_sources(story), (story.source, "calibrated", CALIBRATED)):
        error, bound, unit = source_errors(story, track)
        rows.append((label, color, track.t_s, error, bound))
    _errors(axes, rows, unit, columns)
    search_axis(axes, story)
    _exploration_label(axes, story, float(story.source.t_s[0]))


def error_over_bound(axes: "Axes", story: RunHistory, bounds: Array, columns: int = 2) -> None:
    """Plot the source error over the Cramer-Rao bound of the readings up to then, log scale; `bounds` (k, 2): time [s] and bound [m]."""
    axes.set_title("Source error over its bound", loc="left")
    rows = list[Row]()
    for track, label, color in (*_cold_sources(story), (story.source, "calibrated", CALIBRATED)):
        known = track.t_s >= bounds[0, 0]
        error, _, _ = source_errors(story, track)
        bound_mm = 1e3 * np.exp(np.interp(track.t_s[known], bounds[:, 0], np.log(bounds[:, 1])))
        if np.any(known):
            rows.append((label, color, track.t_s[known], error[known] / bound_mm, None))
    if not rows:
        say(axes, "no belief after the readings told all directions")
        return
    _errors(axes, rows, "ratio", columns, SMALLEST_RATIO)
    axes.axhline(1.0, color="black", lw=1.0, ls=":")
    axes.set_ylabel("error over bound")
    search_axis(axes, story)


def nose_error(axes: "Axes", story: RunHistory, summary: Document, columns: int = 2) -> None:
    """Plot the distance of the nose from the true one, log scale: encoders alone, cold starts, calibrated. Without a truth, the distance
    from the calibrated filter's nose. With the bound below which 95 % lie by each belief; the encoders alone state none."""
    known = len(story.truth) > 0
    axes.set_title("Nose error" if known else "Nose, distance from that of the calibrated filter", loc="left")
    against = story.truth if known else story.odometry
    rows = []
    for track, label, color, key in _noses(story):
        t_s, own, other = track.matched(against)
        off_m = np.linalg.norm(track.p_m[own] - against.p_m[other], axis=1)
        if len(t_s) and track is not against:
            rms_m = number(summary, key, "nose_error_m") if known else None
            label += "" if rms_m is None else f", RMS {1e3 * rms_m:.1f} mm"
            bound = 1e3 * radii_95(track.cov_m2[own]) if np.any(track.cov_m2) else None
            rows.append((label, color, t_s, 1e3 * off_m, bound))
    if not rows:
        say(axes, "no belief and no truth in this log" if not known else "no estimate of the nose in this log")
        return
    _errors(axes, rows, "mm", columns)
    search_axis(axes, story)


def _cold_sources(story: RunHistory) -> Iterator[tuple[TrackOverTime, str, str]]:
    for name, found in story.others.items():
        if name in VARIANTS and len(found.source):
            yield found.source, *VARIANTS[name]


def _noses(story: RunHistory) -> Iterator[tuple[TrackOverTime, str, str, str]]:
    """Track, label, colour and key in the summary of every estimate of the nose, the calibrated last."""
    yield story.dead, "encoders alone", DEAD, "dead_reckoning"
    for name, found in story.others.items():
        if name in VARIANTS:
            yield found.nose, *VARIANTS[name], name
    yield story.odometry, "calibrated", CALIBRATED, "calibrated"


def _errors(axes: "Axes", rows: list[Row], unit: str, columns: int, smallest: float = SMALLEST) -> None:
    bounds = [bound for *_, bound in rows if bound is not None]
    low, high = error_limits([error for *_, error, _ in rows], bounds, smallest)
    for label, color, t_s, error, bound in map(_thinned, rows):
        first = color == CALIBRATED
        axes.plot(t_s, np.maximum(error, low), color=color, lw=1.8 if first else 1.2, label=label, zorder=3 if first else 2)
        if bound is None:
            continue
        axes.plot(t_s, np.maximum(bound, low), color=color, lw=1.2, ls=":")
        if first:
            axes.fill_between(t_s, low, np.maximum(bound, low), color=color, alpha=0.13, lw=0)
    if bounds:
        axes.plot([], [], color="black", lw=1.2, ls=":", label="95 % should lie below")
    error_scale(axes, low, high)
    axes.set_ylabel(f"error ({unit})")
    legend_above(axes, columns)


def _thinned(row: Row) -> Row:
    label, color, t_s, error, bound = row
    every = thinned(t_s)
    return label, color, t_s[every], error[every], None if bound is None else bound[every]


def _exploration_label(axes: "Axes", story: RunHistory, until_s: float) -> None:
    begin_s, end_s = story.search.begin_s, story.search.end_s
    if until_s - begin_s > 0.2 * (end_s - begin_s):
        middle = 0.5 * (until_s - begin_s) / (end_s - begin_s)
        axes.text(middle, 0.5, "exploring:\nno belief yet", transform=axes.transAxes, ha="center", va="center", color="#666666")
