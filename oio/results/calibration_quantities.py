"""Quantities of the fit on the beacon for calibration.yaml: value, standard uncertainty, unit, degrees of freedom, method of evaluation.

Method A: the readings decide. Method B: everything else (GUM 4.3), and also a quantity of the fit of which the readings brought less than
half of the information, or none because the form of the law holds it fixed: its uncertainty is that from before the fit, taken as known.
"""

import numpy as np

from oio.gas.range_law import EXPONENT, LAW
from oio.inference.model_selection import HELD_BELOW, law_form
from oio.kinematics.forward import SLIDE
from oio.results.calibration import Calibration, MapCalibration

Entry = dict[str, object]
HALF = 0.5  # of the information (inverse variance) that the readings must have brought for method A


def entry(value: float, u: float, unit: str, dof: float | None, method: str) -> Entry:
    """One quantity with its uncertainty. dof None: infinitely many degrees of freedom, the uncertainty is taken as known."""
    return {"value": float(value), "u": float(u), "unit": unit, "dof": None if dof is None else round(float(dof), 1), "method": method}


class _Fitted:
    """Makes entries of fitted parameters: the prior that the fit began with is that of the open cold start."""

    def __init__(self, calibration: Calibration, found: MapCalibration) -> None:
        self._prior_sd, self._sd = np.sqrt(np.diag(calibration.cold_open.cov)), np.sqrt(np.diag(found.fit.cov))
        self._n = degrees_of_freedom(found)

    def entry(self, at: int, value: float, unit: str, factor: float = 1.0) -> Entry:
        """Parameter number `at`, in a unit that is `factor` times its own."""
        dof, method = (self._n, "A") if self._measured(at) else (None, "B")
        return entry(value, factor * self._sd[at], unit, dof, method)

    def _measured(self, at: int) -> bool:
        sd, prior_sd = self._sd[at], self._prior_sd[at]
        held = EXPONENT <= at < LAW and sd < HELD_BELOW
        return not held and bool(prior_sd**2 - sd**2 >= HALF * prior_sd**2 > 0.0)


def degrees_of_freedom(found: MapCalibration) -> float:
    """Readings of the fit less its parameters, at least 1."""
    return max(found.fit.readings - found.fit.layout.size, 1)


def sensor_entries(calibration: Calibration, found: MapCalibration) -> Entry:
    """Section `sensor`: per element baseline, gain and noise; lags, delay, error of a reading."""
    lay, mean, n, fitted = found.fit.layout, found.fit.mean, degrees_of_freedom(found), _Fitted(calibration, found)
    model = calibration.chosen.model
    r = found.fit.fluctuation.scale * model.sigma_ppm**2
    elements = {}
    for e, baseline in enumerate(calibration.baselines):
        gain = float(np.exp(mean[lay.gain][e]))
        elements[f"element_{e}"] = {
            "baseline": entry(baseline.ppm, baseline.u_ppm, "ppm", baseline.n_effective - 1, "A"),
            "gain": fitted.entry(lay.gain.start + e, gain, "1", gain),  # that of element 0 is 1 by definition
            "R_white": entry(r, r * np.sqrt(2 / max(baseline.n - 1, 1)), "ppm^2", baseline.n - 1, "A"),
        }
    late = (n, "A") if found.delay.u_s else (None, "B")
    return {
        **elements,
        "tau_rise": fitted.entry(lay.tau, model.rise_s, "s", model.rise_s),
        "tau_fall": fitted.entry(lay.tau, model.fall_s, "s", model.fall_s),
        "delay": entry(found.delay.s, found.delay.u_s, "s", *late),
        "error": entry(calibration.error_ppm, calibration.error_ppm / np.sqrt(2 * max(n, 1)), "ppm", n, "A"),
    }


def range_law_entries(calibration: Calibration, found: MapCalibration) -> Entry:
    """Section `range_law`: parameters of the mean concentration and of its fluctuation."""
    fit, n, fitted = found.fit, degrees_of_freedom(found), _Fitted(calibration, found)
    lay, mean, wind = fit.layout, fit.mean, fit.layout.wind.start
    return {
        "air": law_form(fit),
        "ln_strength": fitted.entry(lay.strength, mean[lay.strength], "ln(ppm)"),
        "exponent": fitted.entry(lay.exponent, mean[lay.exponent], "1"),
        **{f"wind_{'xyz'[i]}": fitted.entry(wind + i, mean[wind + i], "1/m") for i in range(3)},
        "thinning": fitted.entry(lay.thinning, mean[lay.thinning], "1/m"),
        "gamma": entry(fit.fluctuation.gamma, fit.fluctuation.gamma / np.sqrt(2 * max(n, 1)), "1", n, "A"),
        "eddy": entry(fit.fluctuation.t_s, fit.fluctuation.t_s / np.sqrt(max(n, 1)), "s", n, "A"),
        "sway": entry(fit.fluctuation.sway, fit.fluctuation.sway / np.sqrt(2 * max(n, 1)), "1", n, "A"),
    }


def arm_entries(calibration: Calibration, found: MapCalibration) -> Entry:
    """Section `arm`: per joint the encoder's offset and drift, in degrees of a hinge, in metres of a slide."""
    arm, lay, mean, fitted = calibration.chosen.model.arm, found.fit.layout, found.fit.mean, _Fitted(calibration, found)
    out: Entry = {}
    for j, (name, kind) in enumerate(zip(arm.names, arm.model.kinds[: len(arm.names)], strict=True)):
        unit, factor = ("m", 1.0) if kind == SLIDE else ("deg", float(np.degrees(1.0)))
        offset, drift = lay.offset.start + j, lay.drift.start + j
        out[name] = {
            "offset": fitted.entry(offset, factor * mean[offset], unit, factor),
            "drift": fitted.entry(drift, factor * mean[drift], f"{unit}/s^2", factor),
        }
    return out
