"""Warm-up: time constant of the approach to an unknown level, y = level + height exp(-(t - t0) / tau)."""

from dataclasses import dataclass

import numpy as np

from oio.core.errors import NotObservable
from oio.core.records import Array
from oio.identification.curve_fit import fit_curve
from oio.identification.step_response import FEWEST

NO_APPROACH = "no approach to a level stands out of the readings: the sensor was warm; record from its switch-on."


@dataclass(frozen=True, slots=True)
class Settling:
    """Settling of one element: tau with its 95 % interval [s], the level it goes to and the height above it at the first reading."""

    tau_s: float
    tau_low_s: float
    tau_high_s: float
    level: float
    height: float


def settling(t_s: Array, value: Array) -> Settling:
    """Fit the settling of readings value (n,) at t_s (n,) s. Raises NotObservable if they do not settle, or not within the record."""
    if len(value) < FEWEST:
        raise NotObservable(f"{len(value)} readings are too few for a warm-up, {FEWEST} are needed; record longer.")
    if np.ptp(value) == 0.0:
        raise NotObservable(NO_APPROACH)
    t, centre, unit = t_s - t_s[0], float(value.mean()), float(np.std(value))
    y, span_s = (value - centre) / unit, float(t_s[-1] - t_s[0])
    low, high = np.array([-100.0, -1000.0, np.log(0.1 * np.median(np.diff(t)))]), np.array([100.0, 1000.0, np.log(10.0 * span_s)])
    starts = [np.array([y[-1], y[0] - y[-1], np.log(share * span_s)]) for share in (0.02, 0.1, 0.5)]
    fit = fit_curve(_decay, t, y, starts, low, high)
    level, height, tau_s = float(fit.parameters[0]), float(fit.parameters[1]), float(np.exp(fit.parameters[2]))
    if not fit.stands_out(y) or tau_s < 0.5 * float(np.median(np.diff(t))):
        raise NotObservable(NO_APPROACH)
    if tau_s > span_s:
        raise NotObservable(f"the readings have not settled within {span_s / 60.0:.3g} min; record longer.")
    half = float(fit.half_widths[2])
    low_s, high_s = float(tau_s * np.exp(-half)), float(tau_s * np.exp(half))
    return Settling(tau_s, low_s, high_s, centre + unit * level, unit * height)


def _decay(p: Array, t: Array) -> Array:
    level, height, ln_tau = p
    return np.asarray(level + height * np.exp(-t / np.exp(ln_tau)))
