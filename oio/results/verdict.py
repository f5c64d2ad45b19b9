"""Verdict PASS, WARN or FAIL by criteria that a bench can see, and beside it what only simulation knows: the score against the truth."""

import math
from typing import Annotated

from oio.core.settings import Within, settings
from oio.inference.metrics import CHI2_95
from oio.results.criteria.judgement import Criterion, Results, Verdict
from oio.results.evaluation import Outcome, Scored


@settings
class Criteria:
    """Criteria of a verdict by name, in the order of the stages: a cause comes before its effects."""

    criteria: dict[str, Criterion]


def judge(results: Results, by: Criteria) -> Verdict:
    """Judge the results of the stages that have run. The truth enters no criterion."""
    found = [criterion.judge(name, results) for name, criterion in by.criteria.items()]
    return Verdict(tuple(j for j in found if j is not None))


def rarity(nees: float, dof: int) -> float:
    """Return the probability that chi-square with 1, 2 or 3 degrees of freedom exceeds a value."""
    tail = math.erfc(math.sqrt(0.5 * nees))
    return math.exp(-0.5 * nees) if dof == 2 else tail + (math.sqrt(2.0 * nees / math.pi) * math.exp(-0.5 * nees) if dof == 3 else 0.0)


@settings
class ScoreLimits:
    """Limits of the score against the truth, which never enters the verdict."""

    # nees: above this the truth is outside the covariance, beyond chance (chi-square 99.9 %, 3 degrees of freedom: 16.3)
    nees: Annotated[float, Within(0, 1e6)]
    bound_ratio: Annotated[float, Within(0, 1e6)]  # source error over the Cramer-Rao bound
    nowhere: Annotated[float, Within(0, 1e6)]  # standard deviation of the source over that of the workspace box


def score(outcome: Outcome, bound_m: float | None, dof: int, limits: ScoreLimits, box_sd_m: float) -> Scored:
    """Return how the answer compares with the truth, which only simulation knows: RIGHT, WRONG, or `unknown` without a truth, or where the
    region says no place: `box_sd_m` [m] is the standard deviation of one anywhere in the workspace box."""
    if outcome.nees_source is None or outcome.inside_95 is None:
        return Scored("unknown", ())
    if dof >= 3 and outcome.sd_m is not None and outcome.sd_m > limits.nowhere * box_sd_m:
        return Scored("unknown", ("the region is too large to be right or wrong about a place.",))
    reasons = list[str]()
    if not outcome.inside_95:
        limit = CHI2_95[min(dof, 3)]  # a bearing has one or two degrees of freedom
        text = f"the 95 % region misses the source (NEES {outcome.nees_source:.1f}, the region ends at {limit:.1f})"
        by_chance = rarity(outcome.nees_source, min(dof, 3))
        chance = (
            f"chance does that in one run of {1.0 / by_chance:.0f}" if outcome.nees_source <= limits.nees else "the covariance is too small"
        )
        reasons.append(f"{text}: {chance}.")
    if bound_m and outcome.source_error_m is not None and outcome.source_error_m > limits.bound_ratio * bound_m:
        ratio = outcome.source_error_m / bound_m
        reasons.append(f"the source error is {ratio:.1f} times the Cramer-Rao bound, {limits.bound_ratio:g} is usual.")
    return Scored("WRONG" if outcome.nees_source > limits.nees else "RIGHT", tuple(reasons))
