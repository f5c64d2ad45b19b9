"""Readings in clean air: the baseline of each element, and the noise over that of the data sheet."""

import numpy as np

from oio.api.setup import Setup
from oio.core.errors import BadInput
from oio.core.records import Array, GasReading, seconds
from oio.gas.bouts import ElementBaseline, element_baseline

PRIOR_READINGS = 10  # the data sheet's noise counts as this many readings


def baselines_of(air: list[GasReading], setup: Setup) -> tuple[tuple[ElementBaseline, ...], float]:
    """Baseline of each element, and the variance about a line over that of the data sheet."""
    sums, dof, made = float(PRIOR_READINGS), float(PRIOR_READINGS), []
    for e in range(setup.nose.elements):
        own = [reading for reading in air if reading.element == e]
        if len(own) < 3:
            raise BadInput(f"element {e} has {len(own)} readings in clean_air_s, but at least 3 are wanted. Give a longer span.")
        t_s, ppm = columns(own)
        made.append(element_baseline(ppm, float(np.median(np.diff(t_s))), setup.part("nominal").rise_s, own[0].sigma_ppm))
        residual = ppm - np.polyval(np.polyfit(t_s - t_s[0], ppm, 1), t_s - t_s[0])
        sums += float(np.sum((residual / own[0].sigma_ppm) ** 2))
        dof += len(own) - 2
    return tuple(made), max(sums / dof, 0.1)


def columns(own: list[GasReading]) -> tuple[Array, Array]:
    """Return times (m,) [s] and readings (m,) [ppm]."""
    return np.array([seconds(r.t_ns) for r in own]), np.array([r.ppm for r in own])
