"""The sensor's response to a step of gas, as calibrated: first-order rise and fall with their uncertainty."""

from typing import TYPE_CHECKING

import numpy as np

from oio.figures.rounding import with_uncertainty
from oio.figures.style import CALIBRATED, DEAD
from oio.figures.timelines import legend_above, say

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Lag = tuple[float, float]  # time constant and its standard uncertainty [s]
SIGMAS = 2.0


def step_plot(axes: "Axes", rise: Lag | None, fall: Lag | None) -> None:
    """Draw 1 - exp(-t / tau) and exp(-t / tau), the band of two standard uncertainties, and where 63 and 90 % are reached."""
    axes.set_title("Step response, as calibrated", loc="left")
    if rise is None or fall is None:
        say(axes, "this run calibrated no lag")
        return
    t_s = np.linspace(0.0, 5.0 * max(rise[0], fall[0]), 200)
    for (tau_s, u_s), color, name, falls in ((rise, CALIBRATED, "rise", False), (fall, DEAD, "fall", True)):
        slow, fast = tau_s + SIGMAS * u_s, max(tau_s - SIGMAS * u_s, 1e-3)
        middle, late, early = (np.exp(-t_s / tau) if falls else 1.0 - np.exp(-t_s / tau) for tau in (tau_s, slow, fast))
        axes.fill_between(t_s, late, early, color=color, alpha=0.2, lw=0)
        t_90 = tau_s * float(np.log(10.0))
        axes.plot(t_s, middle, color=color, lw=1.6, label=f"{name}: tau {with_uncertainty(tau_s, u_s)} s, 90 % after {t_90:.2g} s")
        axes.plot(t_90, 0.1 if falls else 0.9, "o", ms=5, color=color)
    axes.set_xlabel("time after the step (s)")
    axes.set_ylabel("share of the step")
    legend_above(axes, 1)
