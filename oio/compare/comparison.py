"""What differs between calibrations: a row per quantity, and the verdict over those that are independent.

Taken as independent between two calibrations are all readings of theirs. What the same specimen's calibrations share (one prior, one data
sheet, one gas bottle) is a part of u that does not show in the difference, so that for a parameter which the prior determines, such as a
joint's offset, the test is too lenient, never too strict. Within one calibration the parameters that were fitted together are correlated:
they enter the chi-square by their covariance (`oio.compare.fit_parameters`), the offsets of the elements and the white noise alone.
ln strength enters no sum, because the file does not keep its correlation with the exponent.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, ndtr

from oio.compare.constancy import Constancy, constancy, joint_chi2
from oio.compare.fit_parameters import fitted, fitted_keys
from oio.core.errors import BadInput
from oio.results.calibration_entries import SECTIONS, CalibrationEntries
from oio.results.quantity import Quantity

RARE = 2.0 * float(ndtr(-3.0))  # 3 standard deviations of a normal distribution, two-sided
# What follows from others or from the same residuals: shown, but it decides nothing. gamma, eddy and sway are the likeliest of a list.
_OF_NOISE = "range_law.gamma", "range_law.eddy", "range_law.sway"
FOLLOWS = ("sensor.element_0.gain", "sensor.tau_fall", "sensor.error", *_OF_NOISE, "type_a.", "type_b.")
_SECTION_OF_FACT = {"air": "range_law", "air form": "range_law"}  # other facts always decide


@dataclass(frozen=True, slots=True)
class Row:
    """One quantity in k calibrations: values and u, in `unit`; `test` is None where all are taken as known and equal.

    `counted`: whether it may decide; `flagged`: it differs by what is as rare as 3 standard deviations.
    """

    key: str
    unit: str
    values: tuple[float, ...]
    u: tuple[float, ...]
    test: Constancy | None
    counted: bool

    @property
    def flagged(self) -> bool:
        """Whether the difference is as rare as 3 standard deviations, few degrees of freedom considered."""
        return self.counted and self.test is not None and self.test.p is not None and self.test.p < RARE

    @property
    def sd(self) -> float:
        """Difference (of more than two: the trend) in its standard deviations."""
        return 0.0 if self.test is None else self.test.trend_sd

    @property
    def size(self) -> float:
        """Root of the chi-square: of two calibrations the size of `sd`."""
        return 0.0 if self.test is None else float(np.sqrt(self.test.chi2))


@dataclass(frozen=True)
class Comparison:
    """k calibrations by name, a row per quantity in the order of the file, categorical differences in words that decide and that do not,
    and the chi-square over the independent quantities of the `judged` sections."""

    names: tuple[str, ...]
    rows: tuple[Row, ...]
    facts: tuple[str, ...]
    remarks: tuple[str, ...]
    judged: tuple[str, ...]
    chi2: float
    dof: int

    @property
    def p(self) -> float:
        """Probability of as large a chi-square by chance."""
        return float(chdtrc(self.dof, self.chi2)) if self.dof else 1.0

    @property
    def flagged(self) -> tuple[Row, ...]:
        """Flagged rows of the judged sections, the largest first."""
        return self._flagged(True)

    @property
    def elsewhere(self) -> tuple[Row, ...]:
        """Flagged rows of the other sections, the largest first."""
        return self._flagged(False)

    def _flagged(self, judged: bool) -> tuple[Row, ...]:
        rows = [row for row in self.rows if row.flagged and (row.key.split(".")[0] in self.judged) == judged]
        return tuple(sorted(rows, key=lambda row: -row.size))

    @property
    def agree(self) -> bool:
        """Whether nothing that decides differs."""
        return not self.facts and not self.flagged and self.p >= RARE


def compare(calibrations: Sequence[CalibrationEntries], judged: tuple[str, ...]) -> Comparison:
    """Compare two calibrations or more. Raises BadInput where a unit differs or `judged` names a section that does not exist."""
    if unknown := [section for section in judged if section not in SECTIONS[:3]]:
        raise BadInput(f"--judge has {unknown[0]}, but it can have {', '.join(SECTIONS[:3])}. Type e.g. --judge sensor,arm")
    rows, known = list[Row](), list[str]()
    for key in calibrations[0].quantities:
        if all(key in other.quantities for other in calibrations):
            row = _row([other.quantities[key] for other in calibrations], [other.name for other in calibrations])
            rows.append(row)
            known += [_fact(key, row)] if row.test is None and len(set(row.values)) > 1 else []
    if not rows:
        raise BadInput(f"{calibrations[0].name} shares no quantity with the others. Give calibrations of runs.")
    facts, remarks = _facts(calibrations, judged)
    chi2, dof = _overall(calibrations, rows, judged)
    names = tuple(entries.name for entries in calibrations)
    return Comparison(names, tuple(rows), (*facts, *known, *_missing(calibrations)), remarks, judged, chi2, dof)


def _row(found: list[Quantity], names: list[str]) -> Row:
    first = found[0]
    for quantity, name in zip(found, names, strict=True):
        if quantity.unit != first.unit:
            raise BadInput(f"{first.key} is in {first.unit} in {names[0]}, but in {quantity.unit} in {name}. Give files with one unit.")
    values, u, dof = (np.array([getattr(quantity, name) for quantity in found]) for name in ("value", "u", "dof"))
    test = constancy(values, u, dof) if np.any(u > 0.0) else None
    follows = first.key.startswith(FOLLOWS) or (first.key.endswith(".R_white") and first.key != "sensor.element_0.R_white")
    return Row(first.key, first.unit, tuple(values.tolist()), tuple(u.tolist()), test, not follows)


def _fact(key: str, row: Row) -> str:
    return f"{key} is taken as known: {' against '.join(f'{value:g}' for value in row.values)} {row.unit}"


def _facts(calibrations: Sequence[CalibrationEntries], judged: tuple[str, ...]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Categorical differences in words: those that decide, and those of sections that are not judged."""
    decide, remark = list[str](), list[str]()
    for name in dict.fromkeys(name for entries in calibrations for name in entries.facts):
        given = [entries.facts.get(name) for entries in calibrations]
        if None not in given and len(set(given)) > 1:
            section = _SECTION_OF_FACT.get(name)
            (decide if section is None or section in judged else remark).append(f"{name} is {' against '.join(map(str, given))}")
    return tuple(decide), tuple(remark)


def _missing(calibrations: Sequence[CalibrationEntries]) -> list[str]:
    everywhere = set.intersection(*(set(entries.quantities) for entries in calibrations))
    some = dict.fromkeys(key for entries in calibrations for key in entries.quantities if key not in everywhere)
    return [f"{key} is not in all of them" for key in some if not key.startswith(("type_a.", "type_b."))]


def _overall(calibrations: Sequence[CalibrationEntries], rows: list[Row], judged: tuple[str, ...]) -> tuple[float, int]:
    """Chi-square with its degrees of freedom: of what was fitted together by its covariance, of the rest one by one."""
    counted = [row for row in rows if row.counted and row.test is not None and row.test.p is not None and row.key.split(".")[0] in judged]
    together = [fitted(entries) for entries in calibrations]
    keys, whole = fitted_keys(calibrations[0]), [pair for pair in together if pair is not None]
    chi2, dof = 0.0, 0
    if len(whole) == len(calibrations) and all(fitted_keys(entries) == keys for entries in calibrations):
        at = [i for i, key in enumerate(keys) if any(row.key == key for row in counted)]
        chi2 = joint_chi2(np.array([mean[at] for mean, _ in whole]), np.array([cov[np.ix_(at, at)] for _, cov in whole])) if at else 0.0
        dof = len(at) * (len(calibrations) - 1)
        counted = [row for row in counted if row.key not in keys]
    alone = [row.test for row in counted if row.test is not None and row.key != "range_law.ln_strength"]
    return chi2 + sum(test.normal_chi2 for test in alone), dof + sum(test.dof for test in alone)
