"""What the time series share: label of the time axis, legends above the data, the scale of errors, panels with nothing to show."""

from typing import TYPE_CHECKING

import numpy as np

from oio.core.records import Array
from oio.figures.run_history import RunHistory

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TIME = "time since the run began (s)"
BOUNDS_SHOWN = 0.95  # a bound may be of any size just after a map
ROW_POINTS = 12.5  # height of a row of a legend


def say(axes: "Axes", text: str) -> None:
    """Leave a panel empty but for a text that gives the reason."""
    axes.set_xticks([])
    axes.set_yticks([])
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center")


def legend_above(axes: "Axes", columns: int) -> None:
    """Put the legend between the data and the title, and never over the data."""
    entries = len(axes.get_legend_handles_labels()[1])
    if not entries:
        return
    axes.legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.0), ncol=columns, frameon=False, borderaxespad=0.1, borderpad=0.1, handlelength=1.3,
        columnspacing=1.2, handletextpad=0.5, labelspacing=0.25, fontsize=9.5,
    )  # fmt: skip
    axes.set_title(axes.get_title(loc="left"), loc="left", pad=6.0 + ROW_POINTS * -(-entries // columns))


def search_axis(axes: "Axes", story: RunHistory) -> None:
    """Show the time of the search, or of the whole run if there is none."""
    axes.set_xlim(story.search.begin_s, max(story.search.end_s, story.search.begin_s + 1.0))
    axes.set_xlabel(TIME)


def error_scale(axes: "Axes", low: float, high: float) -> None:
    """Show errors from low to high > low > 0 on a logarithmic scale with ticks that can be read."""
    axes.set_yscale("log")
    axes.set_ylim(low, high)
    axes.set_yticks(log_ticks(low, high))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.minorticks_off()


def log_ticks(low: float, high: float) -> list[float]:
    """Tick positions of a logarithmic axis: 1, 2 and 5 of every decade; fewer over three decades and more, more within one."""
    steps = (1.0,) if high > 1e3 * low else (1.0, 2.0, 5.0) if high > 10 * low else (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)
    ticks = [step * 10.0**decade for decade in range(-6, 7) for step in steps]
    return [tick for tick in ticks if low <= tick <= high]


def error_limits(errors: list[Array], bounds: list[Array], smallest: float) -> tuple[float, float]:
    """Limits of an error axis that hold all errors, from `smallest` at least, and nearly all of their bounds, (k,) each."""
    low = 0.7 * max(min(float(some.min()) for some in (*errors, *bounds)), smallest)
    high = max([float(some.max()) for some in errors] + [float(np.quantile(some, BOUNDS_SHOWN)) for some in bounds])
    return low, max(1.4 * high, 3.0 * low)


def thinned(t_s: Array, most: int = 350) -> slice:
    """Every so many of the stamps (k,) that at most `most`, and their like, are drawn."""
    return slice(None, None, max(1, -(-len(t_s) // most)))
