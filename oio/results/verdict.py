"""Verdict PASS, WARN or FAIL with reasons: each gives the number, the limit, and what to do."""

from dataclasses import dataclass

from scipy.special import chdtri

from oio.core.settings import in_range, settings
from oio.results.summary import Outcome, Verdict


@settings
class Limits:
    """Acceptance limits of a run. A criterion outside its limit gives WARN; a truth far outside the covariance gives FAIL."""

    nees_fail: float  # above this the covariance is inconsistent, beyond chance (chi-square 99.9 %, 3 degrees of freedom: 16.3)
    nis_low: float
    nis_high: float
    baseline_effective: float  # effective sample size of an element's baseline
    bound_ratio: float  # source error over the Cramer-Rao bound
    narrowed: float  # posterior over prior standard deviation: a direction above it is unobservable

    def check(self) -> None:
        """Raise BadInput if `narrowed` is outside 0 to 1."""
        in_range(self, narrowed=(0.0, 1.0))


@dataclass(frozen=True, slots=True)
class Findings:
    """Inputs of the verdict."""

    outcome: Outcome
    bound_m: float | None
    baseline_effective: float
    dof: int
    unseen: tuple[str, ...]  # unobservable directions and ambiguities, as sentences


def judge(found: Findings, limits: Limits) -> Verdict:
    """Return the verdict: FAIL if the covariance is inconsistent (NEES), WARN if any criterion is outside its limits."""
    failures, warnings = _coverage(found, limits), [*_filter(found, limits), *_calibration(found, limits), *_geometry(found)]
    nees = found.outcome.nees_source
    inconsistent = nees is not None and nees > limits.nees_fail
    return Verdict("FAIL" if inconsistent else "WARN" if failures + warnings else "PASS", (*failures, *warnings))


def _coverage(found: Findings, limits: Limits) -> list[str]:
    if found.outcome.inside_95 is not False or found.outcome.nees_source is None:
        return []
    limit = float(chdtri(min(found.dof, 3), 0.05))  # a bearing has one or two degrees of freedom
    text = f"the 95 % region misses the source (NEES {found.outcome.nees_source:.1f}, the region ends at {limit:.1f})"
    if found.outcome.nees_source > limits.nees_fail:
        return [f"{text}; above {limits.nees_fail:g} the covariance is too small: raise range_law.model_discrepancy or process_noise."]
    return [f"{text}: expected in one run of twenty."]


def _filter(found: Findings, limits: Limits) -> list[str]:
    o, reasons = found.outcome, list[str]()
    if not o.found:
        reasons.append(f"the source was not declared within {o.moves} moves: raise stage.navigate.max_moves, or stop.sd_m.")
    if o.nis_mean is not None and not limits.nis_low <= o.nis_mean <= limits.nis_high:
        reasons.append(f"mean NIS is {o.nis_mean:.2f}, {limits.nis_low:g} to {limits.nis_high:g} is consistent: R or gamma is wrong.")
    if found.bound_m is not None and o.source_error_m is not None and o.source_error_m > limits.bound_ratio * found.bound_m:
        ratio = o.source_error_m / found.bound_m
        reasons.append(
            f"the source error is {ratio:.1f} times the Cramer-Rao bound, {limits.bound_ratio:g} is usual: the air differs from the model."
        )
    return reasons


def _calibration(found: Findings, limits: Limits) -> list[str]:
    if found.baseline_effective >= limits.baseline_effective:
        return []
    what = f"the baseline has {found.baseline_effective:.1f} effective independent readings, {limits.baseline_effective:g} are required"
    return [f"{what}: raise stage.baseline.samples."]


def _geometry(found: Findings) -> list[str]:
    if found.dof >= 3:
        return list(found.unseen)
    what = "height and distance" if found.dof == 1 else "distance (a source and its inverse point give the same readings)"
    bearing = f"{what} cannot be found with dof={found.dof}; only the bearing is observable. Add joints: dof=3 or dof=5."
    return [bearing, *found.unseen]
