"""PASS, WARN or FAIL with reasons: each says the number, the limit, and what to do."""

from dataclasses import dataclass

from scipy.special import chdtri

from oio.core.settings import in_range, settings
from oio.results.summary import Outcome, Verdict


@settings
class Limits:
    """When a run is good. A criterion that misses its limit warns; a truth far outside the covariance fails."""

    nees_fail: float  # above this the covariance is wrong, not the luck (chi-square 99.9 %, 3 degrees of freedom: 16.3)
    nis_low: float
    nis_high: float
    baseline_effective: float  # independent readings of an element's baseline
    bound_ratio: float  # source error over the Cramer-Rao bound
    narrowed: float  # posterior over prior standard deviation: a direction above it was not seen

    def check(self) -> None:
        """Refuse a share that is none."""
        in_range(self, narrowed=(0.0, 1.0))


@dataclass(frozen=True, slots=True)
class Findings:
    """What the verdict is about."""

    outcome: Outcome
    bound_m: float | None
    baseline_effective: float
    dof: int
    unseen: tuple[str, ...]  # what the motion could not see, in words


def judge(found: Findings, limits: Limits) -> Verdict:
    """FAIL if the covariance is wrong, WARN if anything is out of its limits."""
    failures, warnings = _coverage(found, limits), [*_filter(found, limits), *_calibration(found, limits), *_geometry(found)]
    nees = found.outcome.nees_source
    wrong = nees is not None and nees > limits.nees_fail
    return Verdict("FAIL" if wrong else "WARN" if failures + warnings else "PASS", (*failures, *warnings))


def _coverage(found: Findings, limits: Limits) -> list[str]:
    if found.outcome.inside_95 is not False or found.outcome.nees_source is None:
        return []
    ends = float(chdtri(min(found.dof, 3), 0.05))  # a bearing has one or two degrees of freedom
    text = f"the 95 % region misses the source (NEES {found.outcome.nees_source:.1f}, the region ends at {ends:.1f})"
    if found.outcome.nees_source > limits.nees_fail:
        return [f"{text}; above {limits.nees_fail:g} the covariance is too small: raise range_law.model_discrepancy or process_noise."]
    return [f"{text}: one run in twenty does."]


def _filter(found: Findings, limits: Limits) -> list[str]:
    o, out = found.outcome, list[str]()
    if not o.found:
        out.append(f"the source was not declared within {o.moves} moves: raise stage.navigate.max_moves, or stop.sd_m.")
    if o.nis_mean is not None and not limits.nis_low <= o.nis_mean <= limits.nis_high:
        out.append(f"mean NIS is {o.nis_mean:.2f}, {limits.nis_low:g} to {limits.nis_high:g} is consistent: R or gamma is off.")
    if found.bound_m is not None and o.source_error_m is not None and o.source_error_m > limits.bound_ratio * found.bound_m:
        ratio = o.source_error_m / found.bound_m
        out.append(
            f"the source error is {ratio:.1f} times the Cramer-Rao bound, {limits.bound_ratio:g} is usual: the air is not the model's."
        )
    return out


def _calibration(found: Findings, limits: Limits) -> list[str]:
    if found.baseline_effective >= limits.baseline_effective:
        return []
    what = f"the baseline is worth {found.baseline_effective:.1f} independent readings, {limits.baseline_effective:g} are wanted"
    return [f"{what}: raise stage.baseline.samples."]


def _geometry(found: Findings) -> list[str]:
    if found.dof >= 3:
        return list(found.unseen)
    what = "height and distance" if found.dof == 1 else "distance (a source and its inverse point smell alike)"
    bearing = f"{what} cannot be found with dof={found.dof}; the bearing is what it can say. Add joints: dof=3 or dof=5."
    return [bearing, *found.unseen]
