"""Verdict PASS, WARN or FAIL from what a bench can see, and beside it what only simulation knows: the score against the truth.

Each reason gives the number, the limit, and what to do.
"""

from dataclasses import dataclass

from oio.core.settings import in_range, settings
from oio.inference.map_fit import CALIBRATED
from oio.inference.metrics import CHI2_95, ResidualTest
from oio.results.summary import Outcome, Scored, Verdict


@settings
class Limits:
    """Acceptance limits of a run. A criterion outside its limit gives WARN; residuals that contradict the model give FAIL."""

    nees_fail: float  # above this the truth is outside the covariance, beyond chance (chi-square 99.9 %, 3 degrees of freedom: 16.3)
    nis_low: float
    nis_high: float
    residuals_high: float  # overdispersion of the last map's whitened residuals
    halves_high: float  # squared Mahalanobis distance of the sources by two halves of the readings
    baseline_effective: float  # effective sample size of an element's baseline
    bound_ratio: float  # source error over the Cramer-Rao bound
    narrowed: float  # posterior over prior standard deviation: a direction above it is unobservable

    def check(self) -> None:
        """Raise BadInput if `narrowed` is outside 0 to 1."""
        in_range(self, narrowed=(0.0, 1.0))


@dataclass(frozen=True, slots=True)
class Findings:
    """Inputs of the verdict, none of which needs the truth."""

    declared: bool
    moves: int
    nis_mean: float | None
    residuals: ResidualTest | None  # of the last map; None without one
    world: str  # that the best hypothesis assumes
    hypotheses: int
    baseline_effective: float
    dof: int
    unseen: tuple[str, ...]  # unobservable directions and ambiguities, as sentences


def judge(found: Findings, limits: Limits) -> Verdict:
    """Return the verdict: FAIL if the residuals or innovations contradict the model, WARN if any other criterion is outside its limit."""
    failures = _consistency(found, limits)
    warnings = [*_position(found), *_world(found), *_calibration(found, limits), *_geometry(found)]
    return Verdict("FAIL" if failures else "WARN" if warnings else "PASS", (*failures, *warnings))


def _consistency(found: Findings, limits: Limits) -> list[str]:
    reasons = list[str]()
    if found.nis_mean is not None and found.nis_mean > limits.nis_high:
        reasons.append(
            f"mean NIS is {found.nis_mean:.2f}, up to {limits.nis_high:g} is consistent: the air is not the one of calibration, or R is "
            f"wrong."
        )
    if found.residuals is not None and found.residuals.overdispersion > limits.residuals_high:
        r = found.residuals
        reasons.append(
            f"the residuals of the last map contradict its model: mean square {r.mean_square:.2f}, autocorrelation "
            f"{r.autocorrelation:.2f}, together {r.overdispersion:.2f}, up to {limits.residuals_high:g} is consistent. Calibrate in the "
            f"air that you search in."
        )
    if found.residuals is not None and found.residuals.halves > limits.halves_high:
        reasons.append(
            f"two halves of the search disagree on the source (squared Mahalanobis distance {found.residuals.halves:.1f}, up to "
            f"{limits.halves_high:g} is chance): something changed, or lies to one side. Search again."
        )
    return reasons


def _position(found: Findings) -> list[str]:
    if found.dof < 3 or found.declared:
        return []
    several = f" {found.hypotheses} places are left." if found.hypotheses > 1 else ""
    return [
        f"the position is unverified: the source was not declared within {found.moves} moves.{several} "
        f"Raise stage.navigate.max_moves, or stop.sd_m."
    ]


def _world(found: Findings) -> list[str]:
    if found.world == CALIBRATED:
        return []
    return [f"the search saw another world than calibration: {found.world} explains it better. Calibrate again to be sure."]


def _calibration(found: Findings, limits: Limits) -> list[str]:
    reasons = list[str]()
    if found.baseline_effective < limits.baseline_effective:
        what = f"the baseline has {found.baseline_effective:.1f} effective independent readings, {limits.baseline_effective:g} are required"
        reasons.append(f"{what}: raise stage.baseline.samples.")
    if found.nis_mean is not None and found.nis_mean < limits.nis_low:
        reasons.append(f"mean NIS is {found.nis_mean:.2f}, from {limits.nis_low:g} on is consistent: R or gamma is too large.")
    return reasons


def _geometry(found: Findings) -> list[str]:
    if found.dof >= 3:
        return list(found.unseen)
    what = "height and distance" if found.dof == 1 else "distance (a source and its inverse point give the same readings)"
    bearing = f"{what} cannot be found with dof={found.dof}; only the bearing is observable. Add joints: dof=3 or dof=5."
    return [bearing, *found.unseen]


def score(outcome: Outcome, bound_m: float | None, dof: int, limits: Limits) -> Scored:
    """Return how the answer compares with the truth, which only simulation knows: RIGHT, WRONG, or `unknown` without a truth."""
    if outcome.nees_source is None or outcome.inside_95 is None:
        return Scored("unknown", ())
    reasons = list[str]()
    if not outcome.inside_95:
        limit = CHI2_95[min(dof, 3)]  # a bearing has one or two degrees of freedom
        text = f"the 95 % region misses the source (NEES {outcome.nees_source:.1f}, the region ends at {limit:.1f})"
        chance = "expected in one run of twenty" if outcome.nees_source <= limits.nees_fail else "the covariance is too small"
        reasons.append(f"{text}: {chance}.")
    if bound_m and outcome.source_error_m is not None and outcome.source_error_m > limits.bound_ratio * bound_m:
        ratio = outcome.source_error_m / bound_m
        reasons.append(f"the source error is {ratio:.1f} times the Cramer-Rao bound, {limits.bound_ratio:g} is usual.")
    return Scored("WRONG" if outcome.nees_source > limits.nees_fail else "RIGHT", tuple(reasons))
