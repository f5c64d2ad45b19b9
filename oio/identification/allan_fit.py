"""White noise N, random walk K, bias instability B and drift R from an Allan curve (IEEE Std 952, annex C), with 95 % intervals.

sigma^2(tau) = N^2 / tau + (2 ln 2 / pi) B^2 + K^2 (tau / 3 + period^2 / (6 tau)) + R^2 tau^2 / 2, by non-negative least squares, each point
weighted by its degrees of freedom over the fitted variance. Readings are samples of the walk, not averages over a period: hence period^2.
Where the curve has another shape than the model's, intervals are wider by the root of its chi-square over degrees of freedom (Birge 1932).
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls
from scipy.special import ndtri

from oio.core.errors import NotObservable
from oio.core.records import Array
from oio.identification.allan import COVERAGE, RANDOM_WALK, AllanCurve, chi2_quantile, degrees_of_freedom, octaves

TERMS = ("N", "B", "K", "R")
UNITS = {"N": "ppm*sqrt(s)", "B": "ppm", "K": "ppm/sqrt(s)", "R": "ppm/s"}
FLAT_FLOOR = 0.664  # sqrt(2 ln 2 / pi): the floor of the deviation over the bias instability
SHARED = (
    3.0  # octaves of one record share its readings: variances of the fit are larger by this than if they did not (tested by simulation)
)
WEIGHTINGS = 4


@dataclass(frozen=True, slots=True)
class Coefficient:
    """One coefficient with its 95 % interval; `value` is None where the record cannot tell it from zero, and `high` its upper limit."""

    name: str
    unit: str
    value: float | None
    low: float
    high: float

    @property
    def relative_u(self) -> float:
        """Half the interval over the value; infinite without a value."""
        return 0.5 * (self.high - self.low) / self.value if self.value else np.inf


@dataclass(frozen=True, slots=True, eq=False)
class AllanFit:
    """Coefficients by name, and the squares (4,) of all terms of the model in the order of `TERMS`."""

    coefficients: dict[str, Coefficient]
    squares: Array
    curve: AllanCurve


def fit_allan(curve: AllanCurve) -> AllanFit:
    """Fit the model to a curve; B only where the curve has a floor. Raises NotObservable for readings that never change."""
    if not np.all(curve.deviation > 0.0):
        raise NotObservable("the readings do not change over some octave, so they have no noise; record at the sensor's full resolution.")
    squares = _nnls(curve, flicker=has_floor(curve))
    covariance = _covariance(squares, curve.tau_s, curve.edf) * birge_ratio(curve, squares)
    coefficients = {name: _coefficient(name, squares[i], np.sqrt(covariance[i, i])) for i, name in enumerate(TERMS)}
    if squares[TERMS.index("B")] == 0.0:  # the curve lies above any floor, so its minimum limits B
        coefficients["B"] = Coefficient("B", UNITS["B"], None, 0.0, float(curve.high.min() / FLAT_FLOOR))
    return AllanFit(coefficients, squares, curve)


def has_floor(curve: AllanCurve) -> bool:
    """Whether the curve has a flat floor, of height 0.664 B, inside the record.

    It has one if it cannot be explained without (chi-square at 99 %), falls to it by more than the intervals, and the fitted curve has its
    minimum there, not at the edge of the record, and most of it is floor. A minimum at the edge only says that the record is too short, and
    the valley between white noise and a random walk is no floor either.
    """
    without, squares = _nnls(curve, flicker=False), _nnls(curve, flicker=True)
    if _misfit(curve, without) - _misfit(curve, squares) < SHARED * float(chi2_quantile(0.99, 1)):
        return False
    model = _design(curve.tau_s) @ squares
    lowest = int(np.argmin(model))
    falls = bool(np.any(curve.low[:lowest] > curve.high[lowest]))
    return falls and lowest < len(model) - 1 and bool(FLAT_FLOOR**2 * squares[TERMS.index("B")] > 0.5 * model[lowest])


def birge_ratio(curve: AllanCurve, squares: Array) -> float:
    """Chi-square of the model with these squares (4,) over its degrees of freedom, at least 1: far above where the model does not fit."""
    ratio, dof = curve.deviation**2 / (_design(curve.tau_s) @ squares), max(len(curve.tau_s) - int(np.count_nonzero(squares)), 1)
    return max(1.0, float(np.sum(0.5 * curve.edf * (ratio - 1.0) ** 2)) / (SHARED * dof))


def forecast_relative_u(fit: AllanFit, name: str, span_s: float) -> float:
    """Relative standard uncertainty that a record of span_s would give a coefficient, by its degrees of freedom; infinite if none.

    For a coefficient that is not identified its upper limit is taken: a smaller one needs a longer record still.
    """
    readings = max(round(span_s / fit.curve.period_s), 16)
    factors = octaves(readings)
    squares, i = fit.squares.copy(), TERMS.index(name)
    if fit.coefficients[name].value is None:
        squares[i] = fit.coefficients[name].high ** 2
    if squares[i] == 0.0:
        return float(np.inf)
    tau_s = np.asarray(factors * fit.curve.period_s, dtype=np.float64)
    edf = degrees_of_freedom(readings + 1, factors, np.full(len(factors), RANDOM_WALK))
    return float(0.5 * np.sqrt(_covariance(squares, tau_s, edf)[i, i]) / squares[i])


def _design(tau_s: Array) -> Array:  # (k, 4), in the order of TERMS; the first tau is the period
    walk = tau_s / 3.0 + tau_s[0] ** 2 / (6.0 * tau_s)
    return np.column_stack([1.0 / tau_s, np.full_like(tau_s, FLAT_FLOOR**2), walk, 0.5 * tau_s**2])


def _nnls(curve: AllanCurve, flicker: bool) -> Array:
    design, variance = _design(curve.tau_s), curve.deviation**2
    design = design * np.array([1.0, float(flicker), 1.0, 1.0])
    expected = variance
    for _ in range(WEIGHTINGS):
        weight = np.sqrt(0.5 * curve.edf) / np.maximum(expected, np.finfo(float).tiny)
        scale = np.maximum(np.abs(design * weight[:, None]).max(axis=0), np.finfo(float).tiny)
        squares = nnls(design * weight[:, None] / scale, variance * weight)[0] / scale
        expected = design @ squares
    return np.asarray(squares)


def _misfit(curve: AllanCurve, squares: Array) -> float:
    """-2 ln likelihood of chi-square distributed variances, up to a constant."""
    ratio = curve.deviation**2 / (_design(curve.tau_s) @ squares)
    return float(np.sum(curve.edf * (ratio - np.log(ratio))))


def _covariance(squares: Array, tau_s: Array, edf: Array) -> Array:
    """Covariance (4, 4) of the squares; of those that are zero as if they alone were added."""
    design, present = _design(tau_s), squares > 0.0
    weighted = design * (np.sqrt(0.5 * edf) / (design @ squares))[:, None]
    covariance = np.zeros((4, 4))
    for i in range(4):
        used = np.flatnonzero(present | (np.arange(4) == i))
        at = int(np.flatnonzero(used == i)[0])
        scale = np.linalg.norm(weighted[:, used], axis=0)
        inverse = np.linalg.pinv((weighted[:, used] / scale).T @ (weighted[:, used] / scale))
        covariance[i, i] = SHARED * inverse[at, at] / scale[at] ** 2
    return covariance


def _coefficient(name: str, square: float, u_square: float) -> Coefficient:
    """Interval of a root: by chi-square with the square's own degrees of freedom; an upper limit where the square is not above zero."""
    edf = 2.0 * (square / u_square) ** 2
    tail = 0.5 * (1.0 - COVERAGE)
    if square < float(ndtri(COVERAGE)) * u_square:
        return Coefficient(name, UNITS[name], None, 0.0, float(np.sqrt(square + float(ndtri(COVERAGE)) * u_square)))
    low, high = edf * square / chi2_quantile(1.0 - tail, edf), edf * square / chi2_quantile(tail, edf)
    return Coefficient(name, UNITS[name], float(np.sqrt(square)), float(np.sqrt(low)), float(np.sqrt(high)))
