"""Temperature and humidity coefficients of a sensor, by regression with intervals that withstand autocorrelation."""

from dataclasses import dataclass

import numpy as np

from oio.core.errors import NotObservable
from oio.core.records import Array
from oio.identification.hac import regression

FEWEST = 40  # readings
TOO_ALIKE = 0.95  # correlation of temperature and humidity above which their effects cannot be separated


@dataclass(frozen=True, slots=True)
class Environment:
    """Coefficients, each with the half-width of its 95 % interval, the share of the variance explained, and the correlation of the two."""

    per_degc: float
    per_degc_half_width: float
    per_pct: float
    per_pct_half_width: float
    explained: float
    correlation: float


def environment(value: Array, temperature_degc: Array, humidity_pct: Array) -> Environment:
    """Regress readings (n,) on temperature (n,) degC and relative humidity (n,) %.

    The gas itself is unknown: where it goes with the weather, so do the coefficients. Raises NotObservable for too few readings, where
    temperature or humidity does not change, or where they change together.
    """
    if len(value) < FEWEST:
        raise NotObservable(f"{len(value)} readings are too few for temperature and humidity, {FEWEST} are needed; record longer.")
    if np.ptp(temperature_degc) == 0.0 or np.ptp(humidity_pct) == 0.0:
        raise NotObservable("temperature or humidity did not change, so its effect cannot be told; record over a day.")
    correlation = float(np.corrcoef(temperature_degc, humidity_pct)[0, 1])
    if abs(correlation) > TOO_ALIKE:
        raise NotObservable(
            f"temperature and humidity changed together (r = {correlation:.2f}), so their effects cannot be separated; change one alone."
        )
    design = np.column_stack([np.ones(len(value)), temperature_degc - temperature_degc.mean(), humidity_pct - humidity_pct.mean()])
    (_, per_degc, per_pct), (_, u_degc, u_pct) = (x.tolist() for x in regression(design, value))
    residual = value - value.mean() - design[:, 1] * per_degc - design[:, 2] * per_pct
    explained = 1.0 - float(np.var(residual)) / max(float(np.var(value)), np.finfo(float).tiny)
    return Environment(per_degc, u_degc, per_pct, u_pct, explained, correlation)
