"""Readings that are left out of a log because the sensor cannot have given them; told by a warning."""

import warnings

import numpy as np

from oio.api.setup import Setup
from oio.core.records import GasReading, seconds
from oio.gas.glitches import glitches


class LeftOut(UserWarning):
    """Some of the readings that were given are not used; the text says which and why."""


def without_glitches(readings: list[GasReading], setup: Setup) -> list[GasReading]:
    """Return the readings but glitches, for which it warns."""
    wrong = np.flatnonzero(glitches(readings, setup.part("nominal").fall_s)).tolist()
    if not wrong:
        return readings
    first = readings[wrong[0]]
    what, it = (f"{len(wrong)} readings are", "the first") if len(wrong) > 1 else ("one reading is", "it is")
    warnings.warn(
        f"{what} left out as glitches: a sensor with this lag cannot come back from there so fast; {it} at "
        f"{seconds(first.t_ns):.1f} s, {first.ppm:.4g} ppm",
        LeftOut, stacklevel=3,
    )  # fmt: skip
    left = {*wrong}
    return [reading for i, reading in enumerate(readings) if i not in left]
