"""Quantities of a whole record: noise of all elements beside each other, twins, a step, the delay behind the joints."""

import numpy as np

from oio.core.records import Array
from oio.identification.delay import delay
from oio.identification.element_noise import element_noise
from oio.identification.step_response import step_response
from oio.identification.twin_elements import average_is_worse, relation
from oio.identify.record import Approaches, ElementReadings, Record
from oio.identify.row import Row, Rows, about, identified

LONGEST_DELAY_S = 5.0


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
        yield about(element.name, f"dead time, {which}", step.dead_s, step.onset_half_width_s, "s")


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


def _twin(first: Array, other: Array, noise_ratio: float, reference: str, name: str, unit: str) -> Rows:
    found = relation(first, other, noise_ratio)
    yield about(name, f"gain / {reference}", found.gain, found.gain_half_width, "1")
    yield about(name, f"offset - {reference}", found.offset, found.offset_half_width, unit, f"where {reference} reads {found.at:.4g}")


def delay_rows(name: str, approaches: Approaches, seed: int) -> Rows:
    """Delay of the readings behind the joints."""
    found = delay(approaches.period_s, approaches.range_m, approaches.ppm, LONGEST_DELAY_S, np.random.default_rng(seed))
    yield Row(name, "delay", found.delay_s, found.low_s, found.high_s, "s", "of the reading behind the joints: dead time and lag together")
