"""Carbon dioxide by light: NDIR (SCD30) and photoacoustic (SCD41). Both are linearised inside and put ppm on the wire."""

import math

from hardware.sensors.nose import Nose
from oio.core.settings import settings


@settings
class Optical(Nose):
    """A sensor whose raw value is ppm, rounded to `step_ppm`."""

    step_ppm: float  # resolution on the wire
    full_ppm: float  # end of the scale

    @property
    def highest_raw(self) -> float:
        """The end of the scale."""
        return self.full_ppm

    def raw(self, ppm: float) -> float:
        """ppm as they stand."""
        return ppm

    def ppm_from_raw(self, raw: float) -> float:
        """ppm as they stand."""
        return raw

    def sigma_ppm(self, ppm: float) -> float:
        """Noise and rounding, the same everywhere: sqrt(sigma^2 + step^2 / 12), GUM F.2.2.1."""
        return math.sqrt(self.spread.noise**2 + self.step_ppm**2 / 12.0)

    def electronics(self, ppm: float, gain: float, signal: float) -> float:
        """gain * ppm + signal, rounded; never below zero nor above the end of the scale."""
        return min(max(round((gain * ppm + signal) / self.step_ppm), 0) * self.step_ppm, self.full_ppm)
