"""Figure of the accuracy benchmark: errors of all trials and coverage of the 95 % region; a column per air, a row per DoF rung."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from oio.figures.style import CALIBRATED, DEAD, RC, TRUTH
from oio.inference.metrics import COVERAGE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CaseLabel = tuple[str, str, str]  # sensor, search, filter: a position on the axis
PANEL_IN = (4.2, 3.4)  # of one air and DoF rung


def draw(trials: Sequence[Any], rows: Mapping[Any, Any], out: Path) -> None:
    """Draw dots for trials, bars for medians; `trials` and `rows` as `oio.bench` makes them. Writes the PNG `out`."""
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    airs, rungs = list(dict.fromkeys(c.air for c in rows)), list(dict.fromkeys(c.dof for c in rows))
    with mpl.rc_context(RC):
        figure = Figure(figsize=(max(PANEL_IN[0] * len(airs), 11.0), PANEL_IN[1] * len(rungs) + 0.8), dpi=100, layout="constrained")
        FigureCanvasAgg(figure)
        grid = figure.subplots(2 * len(rungs), len(airs), squeeze=False, sharex=True, sharey="row", height_ratios=[3, 1] * len(rungs))
        for i, dof in enumerate(rungs):
            for j, air in enumerate(airs):
                cases = {_label(case): (case, row) for case, row in rows.items() if (case.air, case.dof) == (air, dof)}
                _errors(grid[2 * i, j], cases, trials)
                _coverage(grid[2 * i + 1, j], cases)
                grid[2 * i, j].set_title(f"{air}, {dof} DoF", loc="left")
            grid[2 * i, 0].set_ylabel("source error (mm)")
            grid[2 * i + 1, 0].set_ylabel("in 95 %\nregion")
        _case_labels(grid[-1, :], cases)
        figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper center", ncol=4, frameon=False)
        figure.savefig(out, metadata={"Software": None})


def _label(case: Any) -> CaseLabel:
    return case.sensor, case.search, case.ekf


def _errors(axes: "Axes", cases: Mapping[CaseLabel, Any], trials: Sequence[Any]) -> None:
    for x, (case, row) in enumerate(cases.values()):
        errors = np.array([t.score.error_mm for t in trials if t.case == case and t.score is not None])
        side = np.linspace(-0.28, 0.28, len(errors))  # in the order of the seeds: no random jitter
        first: Any = {"label": None} if x else {}
        axes.plot(x + side, errors, "o", color=CALIBRATED, mew=0, ms=5, alpha=0.5, **{"label": "one trial, calibrated", **first})
        for value, color, label in (
            (row.median_mm, CALIBRATED, "median, calibrated"),
            (min(row.cold_mm, row.cold_open_mm), DEAD, "median, better cold start"),
        ):
            axes.plot([x - 0.36, x + 0.36], [value] * 2, color=color, lw=2.4, **{"label": label, **first})
        bounds = [t.score.bound_mm for t in trials if t.case == case and t.score is not None and np.isfinite(t.score.bound_mm)]
        bound = float(np.median(bounds)) if bounds else np.nan
        axes.plot([x - 0.36, x + 0.36], [bound] * 2, color=TRUTH, lw=2.4, ls=":", **{"label": "median Cramer-Rao bound", **first})
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")


def _coverage(axes: "Axes", cases: Mapping[CaseLabel, Any]) -> None:
    axes.axhline(100 * COVERAGE, color=TRUTH, lw=1.2)
    for x, (_, row) in enumerate(cases.values()):
        axes.plot([x, x], [100 * row.covered_low, 100 * row.covered_high], color=CALIBRATED, lw=1.6)
        axes.plot(x, 100 * row.covered, "o", color=CALIBRATED, ms=5)
    axes.set_ylim(-8, 108)
    axes.set_yticks([0, 50, 95], ["0 %", "50 %", "95 %"])


def _case_labels(bottom: Any, cases: Mapping[CaseLabel, Any]) -> None:
    """Label the cases; search and filter are named only where there are several."""
    several = [len({label[i] for label in cases}) > 1 for i in range(3)]
    labels = ["\n".join(word for word, more in zip(label, (True, *several[1:]), strict=True) if more) for label in cases]
    for axes in bottom:
        axes.set_xticks(range(len(labels)), labels, fontsize=9)
