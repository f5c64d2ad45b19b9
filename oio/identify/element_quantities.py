"""Quantities of one element: drift, rest, warm-up, climate, false alarms."""

import numpy as np

from oio.core.errors import NotObservable
from oio.gas.bout_rates import CleanAir, false_alarms
from oio.gas.detection_rule import DetectionRule
from oio.identification.allan import allan_curve
from oio.identification.allan_fit import AllanFit, fit_allan, forecast_relative_u
from oio.identification.element_noise import element_noise
from oio.identification.environment import environment
from oio.identification.regular_series import regular
from oio.identification.settling import settling
from oio.identification.stationarity import kpss, trend
from oio.identify.record import ElementReadings, Record
from oio.identify.row import Row, Rows, about, identified

WANTED = 0.2  # relative standard uncertainty of K that a longer record is recommended for
LONGEST_S = 1e7  # of a record that is recommended
BASELINE = 5  # readings, as the stage takes


def element_rows(record: Record, element: ElementReadings, rule: tuple[str, DetectionRule, int], forecast_s: float) -> list[Row]:
    """All other quantities of one element; `forecast_s` is the length of the record for which K is forecast."""
    return [
        *identified(element.name, "N, B, K, R", _drift, element, record.unit, forecast_s),
        *identified(element.name, "trend", _rest, element, record.unit),
        *identified(element.name, "warm-up tau", _settling, element),
        *identified(element.name, "climate", _climate, record, element),
        *identified(element.name, "false alarms", _alarms, element, *rule),
    ]


def _drift(element: ElementReadings, unit: str, forecast_s: float) -> Rows:
    series = regular(element.t_s, element.value)
    fit = fit_allan(allan_curve(series))
    for name, c in fit.coefficients.items():
        note = {"K": _walk_note(fit, forecast_s), "B": "" if c.value else "no flat floor within the record"}.get(name, "")
        yield Row(element.name, name, c.value, c.low, c.high, c.unit.replace("ppm", unit), note)
    yield Row(element.name, "longest tau", fit.curve.longest_tau_s, None, None, "s", series.account)


def _walk_note(fit: AllanFit, forecast_s: float) -> str:
    if fit.coefficients["K"].relative_u / 2.0 <= WANTED:
        return ""
    spans = np.geomspace(fit.curve.readings * fit.curve.period_s, LONGEST_S, 200)
    enough = next((span for span in spans.tolist() if forecast_relative_u(fit, "K", span) <= WANTED), None)
    told = forecast_relative_u(fit, "K", forecast_s)
    gives = f"; {_duration(forecast_s)} give +-{100.0 * told:.0f} %" if told < 1.0 else ""
    if enough is None:
        return "smaller than a record of four months can tell"
    what = "" if fit.coefficients["K"].value else "one of that size "
    return f"{what}needs {_duration(enough)} for +-{100.0 * WANTED:.0f} %{gives}"


def _duration(span_s: float) -> str:
    return f"{span_s / 60.0:.0f} min" if span_s < 3 * 3600.0 else f"{span_s / 3600.0:.0f} h"


def _rest(element: ElementReadings, unit: str) -> Rows:
    series = regular(element.t_s, element.value)
    line, test = trend(series.t_s, series.value), kpss(series.value)
    yield about(element.name, "trend", 60.0 * line.slope, 60.0 * line.half_width, f"{unit}/min")
    yield Row(element.name, "KPSS p-value", test.p_value, None, None, "1", "" if test.stationary else "not stationary: it has not settled")


def _settling(element: ElementReadings) -> Rows:
    found = settling(element.t_s, element.value)
    yield Row(element.name, "warm-up tau", found.tau_s, found.tau_low_s, found.tau_high_s, "s")


def _climate(record: Record, element: ElementReadings) -> Rows:
    if record.climate is not None:
        found = environment(element.value, record.climate[:, 0], record.climate[:, 1])
        yield about(element.name, "temperature", found.per_degc, found.per_degc_half_width, f"{record.unit}/degC")
        yield about(
            element.name, "humidity", found.per_pct, found.per_pct_half_width, f"{record.unit}/%", f"both explain {found.explained:.0%}"
        )


def _alarms(element: ElementReadings, name: str, rule: DetectionRule, k: int) -> Rows:
    (noise,) = element_noise(element.value[:, None])
    if noise.sigma == 0.0:
        raise NotObservable("the readings never change, so no bout rule can be tried on them.")
    air = CleanAir(noise.sigma, 0.0, float(np.median(np.diff(element.t_s))), 1)
    found = false_alarms(rule, k, air, element.value[:, None], BASELINE)
    yield Row(
        element.name, "false alarms", found.value, *found.interval, "1", f"bouts per reading, bout={name}, k={k}; true if the air was clean"
    )
