"""Allan deviation of the readings in clean air: log-log, with 95 % intervals and the fitted slopes."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from oio.figures.style import ELEMENTS
from oio.figures.timelines import legend_above, log_ticks
from oio.identification.allan_fit import AllanFit

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def allan_plot(axes: "Axes", fits: Mapping[str, AllanFit], unit: str) -> None:
    """Draw each element's curve with its intervals, and the white noise that was fitted as a line of slope -1/2."""
    axes.set_title("Allan deviation in clean air", loc="left")
    for i, (name, fit) in enumerate(fits.items()):
        curve, color = fit.curve, ELEMENTS[i % len(ELEMENTS)]
        below, above = curve.deviation - curve.low, curve.high - curve.deviation
        axes.errorbar(curve.tau_s, curve.deviation, yerr=np.array([below, above]), fmt="o-", ms=4, color=color, capsize=3, label=name)
        white = fit.coefficients["N"].value
        if white:
            label = f"{name}: N = {white:.3g} {unit} \N{SQUARE ROOT}s"
            axes.plot(curve.tau_s, white / np.sqrt(curve.tau_s), color=color, lw=0.9, ls="--", label=label)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks(log_ticks(*axes.get_xlim()))
    axes.set_yticks(log_ticks(*axes.get_ylim()))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
    axes.minorticks_off()
    axes.set_xlabel("averaging time tau (s)")
    axes.set_ylabel(f"Allan deviation ({unit})")
    legend_above(axes, 2)
