"""Figures of a sweep: heat map of median errors over sensor, DoF and air; distribution of the errors of each group."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from oio.core.records import Array
from oio.figures.style import CALIBRATED, DEAD, TRUTH
from oio.figures.timelines import legend_above, log_ticks, say

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PANELS = 2  # of airs beside each other
MOST = 40  # groups in a distribution: more cannot be read


def heat_map(figure: "Figure", medians: Mapping[tuple[str, str, str], float]) -> None:
    """Draw the median error [mm] by (sensor, DoF, air): a panel per air, the number in each field; log scale, white where there is none."""
    airs, sensors, rungs = (list(dict.fromkeys(key[i] for key in medians)) for i in (2, 0, 1))
    lines = max(-(-len(airs) // PANELS), 1)
    panels = figure.subplots(lines, min(max(len(airs), 1), PANELS), squeeze=False, sharey=True).ravel()
    for empty in panels[max(len(airs), 1) :]:
        empty.set_visible(False)
    if not medians:
        say(panels[0], "no position was scored: there is no truth, or fewer than three joints moved")
        return
    known = np.array([value for value in medians.values() if np.isfinite(value)])
    low, high = (np.log10(max(known.min(), 0.1)), np.log10(known.max())) if len(known) else (0.0, 1.0)
    for axes, air in zip(panels, airs, strict=False):  # the last panel may be empty
        grid = np.array([[medians.get((sensor, rung, air), np.nan) for rung in rungs] for sensor in sensors])
        axes.imshow(np.log10(np.maximum(grid, 0.1)), cmap="viridis_r", vmin=low, vmax=max(high, low + 0.1), aspect="auto")
        for (i, j), value in np.ndenumerate(grid):
            dark = np.isfinite(value) and np.log10(max(value, 0.1)) > 0.5 * (low + high)
            axes.text(j, i, f"{value:.1f}" if np.isfinite(value) else "-", ha="center", va="center", color="white" if dark else "black")
        axes.set_xticks(range(len(rungs)), rungs)
        axes.set_yticks(range(len(sensors)), sensors)
        axes.set_title(f"Median error (mm), air {air}" if len(airs) == 1 else f"air {air}", loc="left")
        axes.set_xlabel("DoF")
        axes.grid(visible=False)


def distributions(figure: "Figure", groups: Sequence[tuple[str, Array, Array, Mapping[str, Any]]], unit: str) -> None:
    """Draw a row per group: errors of the calibrated filter (dots), their median with its interval (bar), the cold start's median (cross).

    `groups`: name, calibrated errors (k,), cold errors (k,), and the row of `group_table`.
    """
    axes = figure.subplots()
    shown = [group for group in groups if len(group[1])][:MOST]
    if not shown:
        say(axes, "nothing was scored: there is no truth")
        return
    for y, (_, calibrated, cold, row) in enumerate(shown):
        jitter = y + 0.25 * (np.arange(len(calibrated)) % 5 - 2) / 2.5
        axes.plot(calibrated, jitter, ".", ms=4, color=TRUTH, label="a run" if y == 0 else None)
        axes.plot(np.median(cold), y, "x", ms=7, color=DEAD, label="cold start, median" if y == 0 else None)
        if np.isfinite(row["median_low"]):
            axes.plot([row["median_low"], row["median_high"]], [y, y], color=CALIBRATED, lw=3, solid_capstyle="butt")
        axes.plot(row["median"], y, "d", ms=6, color=CALIBRATED, label="calibrated: median, 95 %" if y == 0 else None)
    axes.set_xscale("log")
    low, high = axes.get_xlim()
    axes.set_xticks(log_ticks(low, high))
    axes.set_xlim(low, high)
    axes.xaxis.set_major_formatter("{x:g}")
    axes.minorticks_off()
    axes.set_xlabel(f"source error ({unit})")
    axes.set_yticks(range(len(shown)), [name for name, *_ in shown])
    axes.set_ylim(len(shown) - 0.4, -0.6)
    left_out = len([group for group in groups if len(group[1])]) - len(shown)
    axes.set_title("Errors by group" + (f"; {left_out} groups more are in the table" if left_out else ""), loc="left")
    legend_above(axes, 2)
