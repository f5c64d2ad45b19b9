"""Consistency of the filter over the search: normalised innovation squared, innovations in standard deviations, and their histogram."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from oio.core.records import Array, Innovation, seconds
from oio.figures.style import CALIBRATED, DEAD, TRUTH
from oio.figures.timelines import TIME, legend_above, say, thinned
from oio.inference.metrics import CHI2_95

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIGMAS = 3.0  # the band in which 99.7 % of the innovations lie
SMOOTHED = 25  # innovations in the running mean of the NIS


def nis_strip(axes: "Axes", innovations: Sequence[Innovation]) -> None:
    """Plot the NIS of every scalar innovation, its running mean, and the limit below which 95 % lie; log scale."""
    axes.set_title("Normalised innovation squared (NIS)", loc="left")
    t_s, z = standardised(innovations)
    if not len(t_s):
        say(axes, "no innovation in this log")
        return
    nis = np.maximum(z**2, 1e-3)
    every = thinned(t_s)
    axes.plot(t_s[every], nis[every], ".", ms=4, color=TRUTH, label="one innovation")
    n = min(SMOOTHED, len(nis))
    mean = np.convolve(z**2, np.ones(n) / n, mode="valid")
    axes.plot(t_s[n - 1 :][every], np.maximum(mean, 1e-3)[every], color=CALIBRATED, lw=1.8, label=f"mean of the last {n}")
    axes.axhline(1.0, color="black", lw=0.9, label="expected mean: 1")
    axes.axhline(CHI2_95[1], color=DEAD, lw=1.0, ls="--", label="95 % should lie below")
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set_ylabel("NIS")
    axes.set_xlabel(TIME)
    legend_above(axes, 2)


def residual_strip(axes: "Axes", innovations: Sequence[Innovation]) -> None:
    """Plot the innovations in their own standard deviations with the band of 3; those outside are marked."""
    axes.set_title(f"Innovations and their {SIGMAS:g} sigma band", loc="left")
    t_s, z = standardised(innovations)
    if not len(t_s):
        say(axes, "no innovation in this log")
        return
    outside = np.abs(z) > SIGMAS
    axes.axhspan(-SIGMAS, SIGMAS, color=CALIBRATED, alpha=0.12, lw=0)
    every = thinned(t_s)
    axes.plot(t_s[~outside][every], z[~outside][every], ".", ms=4, color=CALIBRATED, label="innovation")
    share = f"outside: {100.0 * np.mean(outside):.1f} % (0.3 % expected)"
    axes.plot(t_s[outside], np.clip(z[outside], -10.0, 10.0), "x", ms=6, color=DEAD, label=share)
    axes.set_ylabel("innovation (sigma)")
    axes.set_xlabel(TIME)
    legend_above(axes, 2)


def residual_histogram(axes: "Axes", innovations: Sequence[Innovation]) -> None:
    """Histogram of the same beside the normal distribution."""
    axes.set_title("Histogram", loc="left")
    _, z = standardised(innovations)
    if not len(z):
        say(axes, "no innovation in this log")
        return
    x = np.linspace(-5.0, 5.0, 101)
    axes.hist(np.clip(z, -5.0, 5.0), bins=np.linspace(-5.0, 5.0, 31).tolist(), density=True, color=CALIBRATED, alpha=0.6)
    axes.plot(x, np.exp(-0.5 * x**2) / np.sqrt(2.0 * np.pi), color="black", lw=1.2, label="normal")
    axes.set_yticks([])
    axes.set_xlabel("sigma")
    legend_above(axes, 1)


def standardised(innovations: Sequence[Innovation]) -> tuple[Array, Array]:
    """Return time (k,) [s] and innovation in its standard deviations (k,) of those that the filter used, and that are scalar."""
    used = [i for i in innovations if not i.gated and len(i.residual) == 1 and float(i.cov[0, 0]) > 0.0]
    t_s = np.array([seconds(i.t_ns) for i in used])
    return t_s, np.array([float(i.residual[0]) / float(i.cov[0, 0]) ** 0.5 for i in used])
