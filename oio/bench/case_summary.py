"""Summary statistics over the trials of one case: a row of accuracy.csv."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from oio.bench.score import Case, Score, Trial
from oio.results.statistics import anees_band, rms_ratio, wilson
from oio.sweep.table_1 import Published

NAN = float("nan")


@dataclass(frozen=True, slots=True)
class Row:
    """Medians and shares; `low` and `high` are ends of a 95 % interval. NaN: no trial has a value."""

    trials: int
    failed: int
    median_mm: float
    p90_mm: float
    p95_mm: float
    covered: float  # share of trials whose 95 % region holds the source, that of every place that is left
    covered_low: float
    covered_high: float
    anees: float  # average NEES / 3; 1 is consistent, more is overconfident
    anees_low: float  # 95 % interval of a consistent filter
    anees_high: float
    over_bound: float  # root mean square of the errors over their Cramer-Rao bounds
    filter_mm: float  # median error of the filter alone, before the last map
    filter_anees: float
    moves: float
    declared: float  # share
    declare_s: float  # median, and of moves; infinite for a search without a declaration
    declare_moves: float
    false: float  # false declarations: share of the declared ones that lie far from the source
    false_low: float
    false_high: float
    cold_mm: float  # nominal values taken as known
    cold_open_mm: float  # as open as where the fit on the beacon begins
    gain: float  # median of the better of the two / calibrated median
    wins: int  # trials in which calibrated beats both
    nose_mm: float
    dead_reckoning_mm: float
    calibration_s: float
    paper_calibration_s: float
    error_ppm: float
    paper_error_ppm: float


def rows(trials: Sequence[Trial], published: dict[str, Published]) -> dict[Case, Row]:
    """Return one row per case, in the order of their first trials."""
    cases = list(dict.fromkeys(trial.case for trial in trials))
    return {case: _row([t for t in trials if t.case == case], published.get(case.sensor, Published(NAN, NAN))) for case in cases}


def _row(trials: list[Trial], paper: Published) -> Row:
    scores = [trial.score for trial in trials if trial.score is not None]
    n, median = len(scores), _quantile(scores, "error_mm", 0.5)
    cold, cold_open = _quantile(scores, "cold_error_mm", 0.5), _quantile(scores, "cold_open_error_mm", 0.5)
    covered, declared = sum(s.in_region for s in scores), [s for s in scores if s.declared]
    false = sum(s.false for s in declared)
    covered_low, covered_high = wilson(covered, n) if n else (NAN, NAN)
    false_low, false_high = wilson(false, len(declared)) if declared else (NAN, NAN)
    anees_low, anees_high = anees_band(n) if n else (NAN, NAN)
    return Row(
        trials=len(trials), failed=len(trials) - n,
        median_mm=median, p90_mm=_quantile(scores, "error_mm", 0.9), p95_mm=_quantile(scores, "error_mm", 0.95),
        covered=_share(covered, n), covered_low=covered_low, covered_high=covered_high,
        anees=float(np.mean([s.nees for s in scores])) / 3.0 if n else NAN, anees_low=anees_low, anees_high=anees_high,
        over_bound=_over_bound(scores), filter_mm=_quantile(scores, "filter_mm", 0.5), filter_anees=_mean(scores, "filter_nees") / 3.0,
        moves=_quantile(scores, "moves", 0.5), declared=_share(len(declared), n),
        declare_s=_until_declared(scores, "time_s"), declare_moves=_until_declared(scores, "moves"),
        false=_share(false, len(declared)), false_low=false_low, false_high=false_high,
        cold_mm=cold, cold_open_mm=cold_open, gain=min(cold, cold_open) / median,
        wins=sum(s.error_mm < min(s.cold_error_mm, s.cold_open_error_mm) for s in scores),
        nose_mm=_quantile(scores, "nose_mm", 0.5), dead_reckoning_mm=_quantile(scores, "dead_reckoning_mm", 0.5),
        calibration_s=_quantile(scores, "calibration_s", 0.5), paper_calibration_s=paper.time_s,
        error_ppm=_quantile(scores, "error_ppm", 0.5), paper_error_ppm=paper.error_ppm,
    )  # fmt: skip


def _quantile(scores: Iterable[Score], name: str, share: float) -> float:
    values = [getattr(score, name) for score in scores]
    finite = [value for value in values if np.isfinite(value)]
    return float(np.quantile(finite, share)) if finite else NAN


def _mean(scores: Iterable[Score], name: str) -> float:
    finite = [value for value in (getattr(score, name) for score in scores) if np.isfinite(value)]
    return float(np.mean(finite)) if finite else NAN


def _until_declared(scores: Sequence[Score], name: str) -> float:
    values = sorted(getattr(score, name) if score.declared else np.inf for score in scores)
    return float(values[(len(values) - 1) // 2]) if values else NAN


def _share(count: int, total: int) -> float:
    return count / total if total else NAN


def _over_bound(scores: list[Score]) -> float:
    bounded = [s for s in scores if np.isfinite(s.bound_mm)]
    return rms_ratio([s.error_mm for s in bounded], [s.bound_mm for s in bounded]) if bounded else NAN
