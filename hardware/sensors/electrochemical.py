"""Amperometric electrochemical cell behind a potentiostat (LMP91000): V = V_zero + I R_TIA, I = S C; ppm = (V - V_zero) / (R_TIA S)."""

import math
from typing import Annotated

from hardware.sensors.nose import Nose
from oio.core.settings import Within, settings


@settings
class Electrochemical(Nose):
    """Electrochemical cell of known sensitivity with a transimpedance amplifier and an ADC; the raw value is in counts."""

    sensitivity_na_ppm: Annotated[float, Within(1e-3, 1e6)]  # S [nA/ppm]
    r_tia_ohm: Annotated[float, Within(1, 1e9)]  # feedback resistor of the transimpedance amplifier
    v_ref: Annotated[float, Within(0.1, 20)]  # reference voltage = full scale of the ADC [V]
    v_zero_fraction: Annotated[float, Within(0, 0.99)]  # internal zero as a fraction of v_ref: 0.2, 0.5 or 0.67
    adc_bits: Annotated[int, Within(4, 32)]

    @property
    def counts_per_ppm(self) -> float:
        """Sensitivity [counts/ppm]."""
        return self.sensitivity_na_ppm * 1e-9 * self.r_tia_ohm / self.v_ref * self._full

    @property
    def highest_raw(self) -> float:
        """Full scale of the ADC."""
        return float(self._full)

    @property
    def _full(self) -> int:
        return (1 << self.adc_bits) - 1

    def raw(self, ppm: float) -> float:
        """Convert ppm to counts."""
        return self.v_zero_fraction * self._full + self.counts_per_ppm * ppm

    def ppm_from_raw(self, raw: float) -> float:
        """Convert counts to ppm; negative where the zero current is negative."""
        return (raw - self.v_zero_fraction * self._full) / self.counts_per_ppm

    def sigma_ppm(self, ppm: float) -> float:
        """Standard deviation of the cell's noise and the ADC's quantisation (LSB^2 / 12) [ppm]."""
        return math.sqrt(self.spread.noise**2 + 1.0 / (12.0 * self.counts_per_ppm**2))

    def electronics(self, ppm: float, gain: float, signal: float) -> float:
        """Counts, clipped to the range of the ADC."""
        return float(min(max(round(self.raw(gain * ppm + signal)), 0), self._full))
