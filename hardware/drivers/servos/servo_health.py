"""Health of the servos of an arm: supply voltage, temperature, and faults that persist."""

import numpy as np

from hardware.drivers.servos.bus import ServoHealth


class HealthMonitor:
    """Reads one servo after the other, once in `every` polling cycles; a fault counts after `fault_cycles` cycles in a row."""

    def __init__(self, servos: int, every: int, fault_cycles: int) -> None:
        self.temperature_degc, self.voltage = np.full(servos, np.nan), np.full(servos, np.nan)  # (n,), NaN until read
        self._every, self._most, self._cycles = every, fault_cycles, 0

    def due(self, cycle: int) -> int | None:
        """Index of the servo whose health is due in a polling cycle, if one is."""
        return (cycle // self._every) % len(self.voltage) if cycle % self._every == 0 else None

    def record(self, servo: int, health: ServoHealth) -> None:
        """Keep what was read of a servo (by index)."""
        self.temperature_degc[servo], self.voltage[servo] = health.temperature_degc, health.voltage

    def confirmed(self, fault: str | None) -> str | None:
        """The fault that a cycle reported, if enough cycles in a row have reported one: a single bit may be noise."""
        self._cycles = self._cycles + 1 if fault else 0
        return fault if self._cycles > self._most else None

    @property
    def summary(self) -> str:
        """Lowest supply voltage and highest temperature read so far, as text."""
        if np.all(np.isnan(self.voltage)):
            return "not asked yet"
        return f"{np.nanmin(self.voltage):.1f} V, {np.nanmax(self.temperature_degc):.0f} degC"
