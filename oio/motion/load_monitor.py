"""Load and temperature limits of servos: a joint that is stalled for a second or two, or hot, is told."""

from typing import NamedTuple

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array

MAX_INTERVAL_S = 0.2  # of load that one reading stands for, at most: nobody knows what was before it


class LoadLimits(NamedTuple):
    """Of every servo: load as a fraction of its torque, seconds of full torque above that, and temperature [degC]."""

    load: float
    load_s: float
    temperature_degc: float


class LoadMonitor:
    """Load above `limits.load` adds up with time, load below it counts off; so a push that a move needs is no stall."""

    def __init__(self, limits: LoadLimits, names: tuple[str, ...]) -> None:
        self._limits, self._names = limits, names
        self._felt_s, self._excess_s = np.inf, np.zeros(len(names))

    def feel(self, t_s: float, load: Array, temperature: Array | None) -> str | None:
        """What is too much with load (n,), -1 to 1, and temperature (n,) degC at t_s; NaN where something is not known."""
        loads = self._read("loads", load)
        hot = self._read("temperatures", np.full(len(self._names), np.nan) if temperature is None else temperature)
        for_s = min(max(t_s - self._felt_s, 0.0), MAX_INTERVAL_S)
        self._felt_s = t_s
        known = np.where(np.isnan(loads), self._limits.load, np.minimum(np.abs(loads), 1.0))
        self._excess_s = np.maximum(self._excess_s + (known - self._limits.load) * for_s, 0.0)
        return self._too_hot(hot) or self._too_long()

    def _read(self, what: str, values: Array) -> Array:
        read = np.asarray(values, dtype=float)
        if read.shape != (len(self._names),):
            raise BadInput(f"{what} of shape {read.shape} were felt, but {len(self._names)} joints have one each.")
        return read

    def _too_hot(self, hot: Array) -> str | None:
        j = int(np.argmax(np.nan_to_num(hot, nan=-np.inf)))
        limit = self._limits.temperature_degc
        return f"joint {self._names[j]} is {hot[j]:.0f} degC hot, and {limit:g} are allowed" if hot[j] > limit else None

    def _too_long(self) -> str | None:
        j, limit = int(np.argmax(self._excess_s)), self._limits
        if self._excess_s[j] <= (1.0 - limit.load) * limit.load_s:
            return None
        return f"joint {self._names[j]} had more than {100 * limit.load:g} % of its torque for too long; something may be in its way"
