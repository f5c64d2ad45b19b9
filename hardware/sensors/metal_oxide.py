"""Metal oxide (MOX) sensor in a voltage divider: Rs = R0 A C^-B, V = V_cc R_L / (R_L + Rs). MQ and MiCS are two YAMLs of this file."""

import math
from typing import Annotated

from hardware.sensors.nose import Nose
from oio.core.settings import Within, settings


@settings
class MetalOxide(Nose):
    """Resistive sensor; the raw value is in counts of the divider voltage. `spread` is in ln(resistance)."""

    r0_ohm: Annotated[float, Within(1, 1e9)]  # reference resistance of the law
    law_a: Annotated[float, Within(1e-6, 1e6)]  # A in Rs/R0 = A C^-B, C in ppm
    law_b: Annotated[float, Within(0.01, 10)]  # B
    air_ppm: Annotated[float, Within(1e-6, 1e6)]  # concentration at which the law gives the resistance in clean air [ppm]
    load_ohm: Annotated[float, Within(1, 1e9)]  # load resistor of the divider, low side
    adc_bits: Annotated[int, Within(4, 32)]

    @property
    def highest_raw(self) -> float:
        """Full scale of the ADC."""
        return float(self._full)

    @property
    def _full(self) -> int:
        return (1 << self.adc_bits) - 1

    @property
    def lowest_raw(self) -> float:
        """Lower rail, one count: below it the law gives no resistance."""
        return 1.0

    def raw(self, ppm: float) -> float:
        """Convert ppm above clean air to counts."""
        return self._counts(self.r0_ohm * self.law_a * (max(ppm, 0.0) + self.air_ppm) ** -self.law_b)

    def ppm_from_raw(self, raw: float) -> float:
        """Convert counts to ppm above clean air for a nominal unit; counts at the rails are taken as one count inside them."""
        counts = min(max(raw, 1.0), self._full - 1.0)
        resistance = self.load_ohm * (self._full / counts - 1.0)
        return float((resistance / (self.r0_ohm * self.law_a)) ** (-1.0 / self.law_b) - self.air_ppm)

    def sigma_ppm(self, ppm: float) -> float:
        """Standard deviation dC = C dR / (B R) [ppm]: noise in ln(R) and the quantisation of one count at this reading."""
        c = max(ppm + self.air_ppm, 1e-3)
        counts = min(max(self.raw(ppm), 1.0), self._full - 1.0)
        d_ln_r = self._full / (counts * (self._full - counts)) / math.sqrt(12.0)
        return c / self.law_b * math.hypot(self.spread.noise, d_ln_r)

    def electronics(self, ppm: float, gain: float, signal: float) -> float:
        """Counts; a gain of R0 and a shift of ln(R) both act on the resistance."""
        resistance = self.r0_ohm * self.law_a * (max(ppm, 0.0) + self.air_ppm) ** -self.law_b * gain * math.exp(signal)
        return float(round(self._counts(resistance)))

    def _counts(self, resistance: float) -> float:
        return self._full * self.load_ohm / (self.load_ohm + resistance)
