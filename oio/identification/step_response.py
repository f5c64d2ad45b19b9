"""Time constant and dead time from a step in the readings: first-order lag, y = y0 + h (1 - exp(-(t - onset) / tau)) after the onset."""

from dataclasses import dataclass

import numpy as np

from oio.core.errors import NotObservable
from oio.core.records import Array
from oio.identification.curve_fit import FittedCurve, fit_curve

T63, T90 = 1.0, float(np.log(10.0))  # time constants from the onset to 63 and 90 % of the step
FEWEST = 12  # readings
NO_STEP = "no step stands out of the readings; expose the sensor to gas, and to clean air again, within the record."


@dataclass(frozen=True, slots=True)
class StepResponse:
    """Lag of one step: tau with its 95 % interval, onset and dead time [s] with the half-width of theirs, and the height of the step.

    `dead_s` is None where the time at which the gas changed is not known.
    """

    rises: bool
    height: float
    tau_s: float
    tau_low_s: float
    tau_high_s: float
    onset_s: float
    onset_half_width_s: float
    dead_s: float | None

    @property
    def t63_s(self) -> float:
        """Time from the onset to 63 % of the step [s]."""
        return T63 * self.tau_s

    @property
    def t90_s(self) -> float:
        """Time from the onset to 90 % of the step [s]."""
        return T90 * self.tau_s


def step_response(t_s: Array, value: Array, gas_s: float | None = None) -> StepResponse:
    """Fit the lag to readings value (n,) at t_s (n,) s with one step among them; `gas_s` is when the gas changed, if that is known.

    The interval of tau is that of ln tau by the covariance of the fit, for correlated residuals. Raises NotObservable if there is no step,
    if it ends before one time constant has passed, or if it is over between two readings.
    """
    if len(value) < FEWEST:
        raise NotObservable(f"{len(value)} readings are too few for a step, {FEWEST} are needed; record longer.")
    if np.ptp(value) == 0.0:
        raise NotObservable(NO_STEP)
    t, y, unit = t_s - t_s[0], value - value.mean(), float(np.std(value))
    fit = fit_curve(_lagged, t, y / unit, _starts(t, y / unit), *_bounds(t))
    _, height, onset_s, ln_tau = fit.parameters.tolist()
    tau_s, half = float(np.exp(ln_tau)), float(fit.half_widths[3])
    _refuse(t, y / unit, fit, tau_s)
    onset_s += float(t_s[0])
    dead_s = None if gas_s is None else onset_s - gas_s
    low_s, high_s = tau_s * np.exp(-half), tau_s * np.exp(half)
    return StepResponse(height > 0.0, height * unit, tau_s, float(low_s), float(high_s), onset_s, float(fit.half_widths[2]), dead_s)


def _lagged(p: Array, t: Array) -> Array:
    y0, height, onset_s, ln_tau = p
    return np.asarray(y0 - height * np.expm1(-np.maximum(t - onset_s, 0.0) / np.exp(ln_tau)))


def _starts(t: Array, y: Array) -> list[Array]:
    """Starts at the three onsets and time constants of a coarse grid that fit best, level and height by least squares."""
    found = []
    for onset_s in np.quantile(t, np.linspace(0.02, 0.95, 32)):
        for tau_s in np.geomspace(0.5 * np.median(np.diff(t)), 0.5 * t[-1], 10):
            design = np.column_stack([np.ones_like(t), -np.expm1(-np.maximum(t - onset_s, 0.0) / tau_s)])
            level, *_ = np.linalg.lstsq(design, y, rcond=None)
            found.append((float(np.sum((design @ level - y) ** 2)), np.array([*level, onset_s, np.log(tau_s)])))
    return [start for _, start in sorted(found, key=lambda pair: pair[0])[:3]]


def _bounds(t: Array) -> tuple[Array, Array]:
    shortest, longest = 0.1 * float(np.median(np.diff(t))), 10.0 * float(t[-1])
    return np.array([-100.0, -100.0, t[0], np.log(shortest)]), np.array([100.0, 100.0, t[-1], np.log(longest)])


def _refuse(t: Array, y: Array, fit: FittedCurve, tau_s: float) -> None:
    if not fit.stands_out(y - np.polyval(np.polyfit(t, y, 1), t)):
        raise NotObservable(NO_STEP)
    period_s, after_s = float(np.median(np.diff(t))), float(t[-1] - fit.parameters[2])
    if tau_s > after_s:
        raise NotObservable(f"the step had {after_s:.3g} s and its time constant is longer; hold the gas for three time constants.")
    if tau_s < 0.5 * period_s:
        raise NotObservable(f"the step is over between two readings, {period_s:.3g} s apart; its lag is shorter than that.")
