"""Optical carbon dioxide sensors: NDIR (SCD30) and photoacoustic (SCD41). Both are linearised internally and report ppm."""

import math
from typing import Annotated

from hardware.sensors.nose import Nose
from oio.core.settings import Within, settings


@settings
class Optical(Nose):
    """Sensor whose raw value is ppm, rounded to `step_ppm`."""

    step_ppm: Annotated[float, Within(1e-6, 1e4)]  # resolution on the wire
    full_ppm: Annotated[float, Within(1, 1e6)]  # end of the scale

    @property
    def highest_raw(self) -> float:
        """End of the scale [ppm]."""
        return self.full_ppm

    def raw(self, ppm: float) -> float:
        """Convert ppm to raw: the identity."""
        return ppm

    def ppm_from_raw(self, raw: float) -> float:
        """Convert raw to ppm: the identity."""
        return raw

    def sigma_ppm(self, ppm: float) -> float:
        """Standard deviation of noise and rounding, constant over the scale: sqrt(sigma^2 + step^2 / 12), GUM F.2.2.1 [ppm]."""
        return math.sqrt(self.spread.noise**2 + self.step_ppm**2 / 12.0)

    def electronics(self, ppm: float, gain: float, signal: float) -> float:
        """Raw value gain * ppm + signal, rounded; clipped to zero and the end of the scale."""
        return min(max(round((gain * ppm + signal) / self.step_ppm), 0) * self.step_ppm, self.full_ppm)
