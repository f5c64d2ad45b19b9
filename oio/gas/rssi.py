"""RSSI of a concentration and its range: the log-distance path loss model (section II-D of the paper)."""

from dataclasses import dataclass

import numpy as np

from oio.core.records import Array


@dataclass(frozen=True, slots=True)
class Rssi:
    """RSSI 10 log10(C / C_ref) [dB] and its range d0 10^((RSSI0 - RSSI) / 10 n) [m] (log-distance path loss; section II-D of the paper)."""

    c_ref_ppm: float  # concentration of 0 dB
    d0_m: float
    rssi0_db: float  # at d0
    exponent: float

    def of(self, c_ppm: Array) -> Array:
        """Convert concentrations (k,) [ppm] to RSSI [dB]; values are clipped below at C_ref / 1000."""
        return 10.0 * np.log10(np.maximum(c_ppm, 1e-3 * self.c_ref_ppm) / self.c_ref_ppm)

    def range_m(self, rssi_db: Array) -> Array:
        """Convert RSSI [dB] to range [m]."""
        return self.d0_m * 10.0 ** ((self.rssi0_db - rssi_db) / (10.0 * self.exponent))
