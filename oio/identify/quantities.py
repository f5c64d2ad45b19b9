"""Rows of the table: every quantity that a record can tell, with its interval, or the sentence that says why it cannot."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from oio.core.errors import NotObservable
from oio.core.records import Array
from oio.gas.bout_rates import CleanAir, false_alarms
from oio.gas.bouts import DetectionRule
from oio.identification.allan import allan_curve
from oio.identification.allan_fit import AllanFit, fit_allan, forecast_relative_u
from oio.identification.delay import delay
from oio.identification.element_noise import element_noise
from oio.identification.environment import environment
from oio.identification.regular_series import regular
from oio.identification.settling import settling
from oio.identification.stationarity import kpss, trend
from oio.identification.step_response import step_response
from oio.identification.twin_elements import average_is_worse, relation
from oio.identify.record import Approaches, ElementReadings, Record

WANTED = 0.2  # relative standard uncertainty of K that a longer record is recommended for
LONGEST_S = 1e7  # of a record that is recommended
LONGEST_DELAY_S = 5.0
BASELINE = 5  # readings, as the stage takes


@dataclass(frozen=True, slots=True)
class Row:
    """One quantity of one element; value and interval are None where `note` says why."""

    element: str
    quantity: str
    value: float | None
    low: float | None
    high: float | None
    unit: str
    note: str = ""


Rows = Iterator[Row]


def noise_rows(record: Record) -> list[Row]:
    """Noise, bout threshold and flag of every element."""
    rows = list[Row]()
    for element, found in zip(record.elements, element_noise(record.side_by_side()), strict=True):
        note = (
            f"noisier than the others; with a threshold of its own ({found.threshold:.3g} {record.unit}) it does no harm"
            if found.noisy
            else ""
        )
        rows.append(Row(element.name, "noise", found.sigma, None, None, record.unit, note))
        rows.append(Row(element.name, "threshold", found.threshold, None, None, record.unit))
    return rows


def element_rows(record: Record, element: ElementReadings, rule: tuple[str, DetectionRule, int], forecast_s: float) -> list[Row]:
    """All other quantities of one element; `forecast_s` is the length of the record for which K is forecast."""
    return [
        *identified(element.name, "N, B, K, R", _drift, element, record.unit, forecast_s),
        *identified(element.name, "trend", _rest, element, record.unit),
        *identified(element.name, "warm-up tau", _settling, element),
        *identified(element.name, "climate", _climate, record, element),
        *identified(element.name, "false alarms", _alarms, element, *rule),
    ]


def identified(element: str, quantity: str, part: Callable[..., Iterable[Row]], *arguments: Any) -> list[Row]:
    """The rows of a part, or one that says why there is none."""
    try:
        return list(part(*arguments))
    except NotObservable as reason:
        return [Row(element, quantity, None, None, None, "", str(reason))]


def step_rows(element: ElementReadings, begin_s: float, end_s: float, gas_s: float | None, unit: str) -> Rows:
    """Lag of the step between two times of the record."""
    part = element.between(element.t_s[0] + begin_s, element.t_s[0] + end_s)
    step = step_response(part.t_s, part.value, None if gas_s is None else element.t_s[0] + gas_s)
    which = "rise" if step.rises else "fall"
    yield Row(element.name, f"tau, {which}", step.tau_s, step.tau_low_s, step.tau_high_s, "s")
    yield Row(
        element.name, f"t90, {which}", step.t90_s, step.t90_s * step.tau_low_s / step.tau_s, step.t90_s * step.tau_high_s / step.tau_s, "s"
    )
    yield Row(element.name, f"height, {which}", step.height, None, None, unit)
    if step.dead_s is not None:
        yield _about(element.name, f"dead time, {which}", step.dead_s, step.onset_half_width_s, "s")


def twin_rows(record: Record) -> list[Row]:
    """Gain and offset of each element relative to the first, and what their average is worth."""
    together, first = record.together(), record.elements[0]
    ratios, own_ratios = _ratios(together), _ratios(record.side_by_side())  # interpolation smoothes, and a fit must know it
    rows = list[Row]()
    for i, element in enumerate(record.elements[1:], 1):
        ratio = own_ratios[i]
        pair = together[:, 0], together[:, i], ratios[i]
        rows += identified(element.name, f"gain / {first.name}", _twin, *pair, first.name, element.name, record.unit)
        if average_is_worse(1.0, ratio):
            better, worse = (first.name, element.name) if ratio > 1.0 else (element.name, first.name)
            note = f"the variance of {worse} is more than 3 times that of {better}: their average is noisier than {better} alone"
            rows.append(Row(element.name, f"variance / {first.name}", ratio, None, None, "1", note))
    return rows


def _ratios(value: Array) -> list[float]:
    """Noise variances of the elements of readings (n, m) over that of the first; 1 where one of them does not change at all."""
    sigmas = [noise.sigma for noise in element_noise(value)]
    return [(sigma / sigmas[0]) ** 2 if sigma > 0.0 and sigmas[0] > 0.0 else 1.0 for sigma in sigmas]


def delay_rows(name: str, approaches: Approaches, seed: int) -> Rows:
    """Delay of the readings behind the joints."""
    found = delay(approaches.period_s, approaches.range_m, approaches.ppm, LONGEST_DELAY_S, np.random.default_rng(seed))
    yield Row(name, "delay", found.delay_s, found.low_s, found.high_s, "s", "of the reading behind the joints: dead time and lag together")


def _about(element: str, quantity: str, value: float, half: float, unit: str, note: str = "") -> Row:
    return Row(element, quantity, value, value - half, value + half, unit, note)


def _twin(first: Array, other: Array, noise_ratio: float, reference: str, name: str, unit: str) -> Rows:
    found = relation(first, other, noise_ratio)
    yield _about(name, f"gain / {reference}", found.gain, found.gain_half_width, "1")
    yield _about(name, f"offset - {reference}", found.offset, found.offset_half_width, unit, f"where {reference} reads {found.at:.4g}")


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
    yield _about(element.name, "trend", 60.0 * line.slope, 60.0 * line.half_width, f"{unit}/min")
    yield Row(element.name, "KPSS p-value", test.p_value, None, None, "1", "" if test.stationary else "not stationary: it has not settled")


def _settling(element: ElementReadings) -> Rows:
    found = settling(element.t_s, element.value)
    yield Row(element.name, "warm-up tau", found.tau_s, found.tau_low_s, found.tau_high_s, "s")


def _climate(record: Record, element: ElementReadings) -> Rows:
    if record.climate is not None:
        found = environment(element.value, record.climate[:, 0], record.climate[:, 1])
        yield _about(element.name, "temperature", found.per_degc, found.per_degc_half_width, f"{record.unit}/degC")
        yield _about(
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
