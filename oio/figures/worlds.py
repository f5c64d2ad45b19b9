"""Figure of the benchmark of changed worlds: heat maps of median error, coverage, declared share, and wrong answers that pass."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from oio.figures.style import RC

CELL_IN = (0.62, 0.30)  # of one case
PANELS: tuple[tuple[str, str, float, float, str], ...] = (
    ("median error (mm)", "median_mm", 1.0, 60.0, "viridis_r"),
    ("in 95 % region (%)", "covered", 0.0, 100.0, "viridis"),
    ("declared (%)", "declared", 0.0, 100.0, "viridis"),
    ("declared, but wrong (%)", "false", 0.0, 20.0, "viridis_r"),
)


def draw(rows: Sequence[Any], out: Path) -> None:
    """Draw one cell per world (row) and sensor and air (column); `rows` as `oio.bench.worlds` makes them. Writes the PNG `out`."""
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    worlds, cases = list(dict.fromkeys(r.world for r in rows)), list(dict.fromkeys((r.sensor, r.air) for r in rows))
    width = len(PANELS) * (0.5 + CELL_IN[0] * max(len(cases), 3)) + 2.0
    with mpl.rc_context(RC):
        figure = Figure(figsize=(width, CELL_IN[1] * len(worlds) + 1.8), dpi=100, layout="constrained")
        FigureCanvasAgg(figure)
        for axes, (title, name, low, high, colours) in zip(
            figure.subplots(1, len(PANELS), squeeze=False, sharey=True)[0], PANELS, strict=True
        ):
            values = np.full((len(worlds), len(cases)), np.nan)
            for r in rows:
                values[worlds.index(r.world), cases.index((r.sensor, r.air))] = _value(r, name)
            axes.imshow(values, cmap=colours, vmin=low, vmax=high, aspect="auto")
            axes.grid(False)
            for (i, j), value in np.ndenumerate(values):
                if np.isfinite(value):
                    axes.text(j, i, f"{value:.0f}", ha="center", va="center", fontsize=8, color="white", bbox=_BEHIND)
            axes.set_xticks(range(len(cases)), [f"{sensor}\n{air}" for sensor, air in cases], fontsize=8)
            axes.set_yticks(range(len(worlds)), worlds, fontsize=9)
            axes.set_title(title, loc="left", fontsize=10)
        figure.savefig(out, metadata={"Software": None})


_BEHIND = {"boxstyle": "round,pad=0.15", "facecolor": "black", "alpha": 0.35, "linewidth": 0.0}


def _value(row: Any, name: str) -> float:
    if name == "median_mm":
        return float(row.median_mm)
    if name == "covered":
        return 100.0 * float(row.covered)
    if name == "declared":
        return 100.0 * float(row.declared) / max(int(row.trials) - int(row.failed), 1)
    return 100.0 * float(row.false_share)
