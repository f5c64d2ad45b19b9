"""Load and temperature limits of servos: detects a joint that is stalled for a second or two, or too hot."""

from typing import NamedTuple

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array

MAX_INTERVAL_S = 0.2  # that one reading of load stands for, at most: what was before it is unknown


class LoadLimits(NamedTuple):
    """Of every servo: load as a fraction of its torque, seconds of full torque above that, and temperature [degC]."""

    load: float
    load_s: float
    temperature_degc: float


class LoadMonitor:
    """Integrates load above `limits.load` and subtracts load below it, so that the short peak of an acceleration is no stall."""

    def __init__(self, limits: LoadLimits, names: tuple[str, ...]) -> None:
        self._limits, self._names = limits, names
        self._last_s, self._excess_s = np.inf, np.zeros(len(names))
        self._heard = np.zeros(len(names), dtype=np.bool_)

    @property
    def unwatched(self) -> tuple[str, ...]:
        """Joints that no load will ever stop: none was heard of them yet, or the limit is all of their torque."""
        return tuple(name for name, heard in zip(self._names, self._heard, strict=True) if not heard or self._limits.load >= 1.0)

    def check(self, t_s: float, load: Array, temperature: Array | None) -> str | None:
        """The overload in words, if any, with load (n,), -1 to 1, and temperature (n,) degC at t_s; NaN where unknown."""
        loads = self._read("loads", load)
        self._heard |= np.isfinite(loads)
        hot = None if temperature is None else self._too_hot(self._read("temperatures", temperature))
        for_s = min(max(t_s - self._last_s, 0.0), MAX_INTERVAL_S)
        self._last_s = t_s
        known = np.where(np.isnan(loads), self._limits.load, np.minimum(np.abs(loads), 1.0))
        self._excess_s = np.maximum(self._excess_s + (known - self._limits.load) * for_s, 0.0)
        return hot or self._too_long()

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
