"""Readings of the whole run, with the baseline and the bouts of the calibration over them."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from oio.core.records import Event, seconds
from oio.figures.gas_timeline import gas
from oio.figures.run_history import RunHistory
from oio.figures.style import DEAD
from oio.figures.timelines import legend_above

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def bout_signal(axes: "Axes", story: RunHistory, bouts: Sequence[Event], baselines_ppm: Sequence[float]) -> None:
    """Plot readings, stages, each element's baseline, and a mark at each bout."""
    gas(axes, story)
    if not story.readings:
        return
    for baseline_ppm in baselines_ppm:
        axes.axhline(baseline_ppm, color="#777777", lw=0.7, ls=":")
    if bouts:
        t_s, ppm = np.array([seconds(r.t_ns) for r in story.readings]), np.array([r.ppm for r in story.readings])
        at_s = np.array([seconds(bout.t_ns) for bout in bouts])
        axes.plot(at_s, np.interp(at_s, t_s, ppm), "v", ms=6, color=DEAD, mec="black", mew=0.6, ls="none", label=f"{len(bouts)} bouts")
    if baselines_ppm:
        axes.plot([], [], color="#777777", lw=0.9, ls=":", label="baselines" if len(baselines_ppm) > 1 else "baseline")
    axes.set_title("Gas readings, bouts and stages", loc="left")
    legend_above(axes, 4)
