"""Readings that are left out because they are no measurement, or because the sensor cannot have given them; told by a warning."""

import warnings
from collections import Counter
from collections.abc import Sequence

import numpy as np

from oio.api.samples import Readings, check_element
from oio.api.setup import Setup
from oio.core.errors import BadInput
from oio.core.records import GasReading, seconds
from oio.gas.glitches import glitches

LEVEL = 4  # of the stack, from here to the program that calls oio.calibrate or oio.locate


class LeftOut(UserWarning):
    """Some of the readings that were given are not used; the text says which and why."""


def sensible(parts: Sequence[Readings], setup: Setup) -> list[GasReading]:
    """Return the measurements of some readings, in order of time, but glitches; warns of what it leaves out.

    Raises BadInput if none of a part is a measurement.
    """
    kept = list[GasReading]()
    for part in parts:  # no comprehension, which is a frame of the stack in some versions of Python
        kept += _measured(part, setup)
    return _without_glitches(kept, setup)


def _measured(part: Readings, setup: Setup) -> list[GasReading]:
    check_element(int(np.asarray(part.element).max()), setup.nose)
    reasons = part.no_measurement(setup.nose)
    if None not in reasons:
        told = "; ".join(f"{count} are {why}" for why, count in Counter(map(str, reasons)).items())
        raise BadInput(
            f"none of the {len(part)} readings from {float(np.asarray(part.t_s)[0]):.1f} s on is a measurement: {told}. Look at the "
            f"sensor: one that is dead, saturated or not connected answers so."
        )
    for why, count in Counter(why for why in reasons if why is not None).items():
        first = reasons.index(why)
        value, unit = float(np.asarray(part.raw if part.ppm is None else part.ppm)[first]), "raw" if part.ppm is None else "ppm"
        at_s = float(np.asarray(part.t_s)[first])
        what, it = (f"{count} readings are", "the first") if count > 1 else ("one reading is", "it is")
        warnings.warn(f"{what} left out: {value:g} {unit}, {why}; {it} at {at_s:.1f} s", LeftOut, stacklevel=LEVEL)
    return part.records(setup.nose, setup.part("nominal").sigma_ppm)


def _without_glitches(readings: list[GasReading], setup: Setup) -> list[GasReading]:
    wrong = np.flatnonzero(glitches(readings, setup.part("nominal").fall_s)).tolist()
    if not wrong:
        return readings
    warnings.warn(told_of_glitches([readings[i] for i in wrong]), LeftOut, stacklevel=LEVEL)
    left = {*wrong}
    return [reading for i, reading in enumerate(readings) if i not in left]


def told_of_glitches(wrong: Sequence[GasReading]) -> str:
    """Return a sentence on readings that are left out as glitches."""
    first = wrong[0]
    what, it = (f"{len(wrong)} readings are", "the first") if len(wrong) > 1 else ("one reading is", "it is")
    return (
        f"{what} left out as glitches: a sensor with this lag cannot come back from there so fast; {it} at "
        f"{seconds(first.t_ns):.1f} s, {first.ppm:.4g} ppm"
    )
