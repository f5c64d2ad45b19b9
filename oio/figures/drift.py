"""Figure of the drift benchmark: nose error over time, filter against dead reckoning, a line per seed."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from oio.figures.style import CALIBRATED, DEAD, RC

PANEL_IN = (6.0, 4.2)


def draw(found: Mapping[Any, Sequence[Sequence[Any]]], out: Path) -> None:
    """Draw a panel per case; `found` has, for each case, a series of `NoseErrorSample` per seed. Writes the PNG `out`."""
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with mpl.rc_context(RC):
        figure = Figure(figsize=(PANEL_IN[0] * max(len(found), 2), PANEL_IN[1] + 0.6), dpi=100, layout="constrained")
        FigureCanvasAgg(figure)
        panels = figure.subplots(1, len(found), squeeze=False, sharey=True)[0]
        for axes, (case, series) in zip(panels, found.items(), strict=True):
            for name, color, label in (("dead_reckoning_mm", DEAD, "dead reckoning"), ("nose_mm", CALIBRATED, "filter")):
                for trial in series:
                    axes.plot([s.after_s for s in trial], [getattr(s, name) for s in trial], color=color, lw=0.8, alpha=0.4)
                axes.plot(*_median(series, name), color=color, lw=2.4, label=f"{label}, median")
            axes.set_title(f"source {case.source}: {case.sensor}, {case.air}, {case.dof} DoF, {case.ekf}", loc="left")
            axes.set_xlabel("time since the arm began (s)")
            axes.set_yscale("log")
            axes.yaxis.set_major_formatter("{x:g}")
        panels[0].set_ylabel("error of the nose (mm)")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncol=2, frameon=False)
        figure.savefig(out, metadata={"Software": None})


def _median(series: Sequence[Sequence[Any]], name: str) -> tuple[list[float], list[float]]:
    times = sorted({s.after_s for trial in series for s in trial})
    return times, [float(np.median([getattr(s, name) for trial in series for s in trial if s.after_s == t])) for t in times]
