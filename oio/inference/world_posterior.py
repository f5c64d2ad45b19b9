"""Posterior over worlds: hypotheses of all fitted worlds compared by evidence, those of one place merged, those of others kept apart."""

from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from oio.core.records import Array
from oio.gas.range_law import LN_STRENGTH, SOURCE
from oio.gas.source_shape import TWO
from oio.inference.alternatives import WORLDS, Alternative, Alternatives
from oio.inference.forward_model import Problem
from oio.inference.map_fit import Fit, solve
from oio.inference.residual_test import Candidate

ONE_SIDED_95 = 1.645
EXTENT_M = 0.12  # two sources nearer than this may be one extended source
MARGIN_M = 0.05  # by which a source may lie outside the workspace box of the nose
EXTENDED = (WORLDS["line"], WORLDS["ring"])
VAGUE_M = 0.03  # standard deviation of a source above which neither its shape shows nor its strength beside another's
PRIOR_SDS = 3.0  # start values are moved to within so many prior standard deviations: fits that start farther off run out of steps


def fit_alternatives(
    settings: Alternatives, problem: Problem, best: Fit, before: Iterable[Fit], chosen: Container[str] | None = None
) -> list[list[Candidate]]:
    """Return the fits of every alternative world (or of the `chosen` names), from its own start values and from an earlier fit of it.

    Lines and rings cost as much as all others together. While the source is vague, they are fitted only if one of the others, such as two
    sources or a wall, explains the readings better than the calibrated world does; a corner only if a wall does.
    """
    earlier, worlds, fitted = {fit.world: fit for fit in reversed(tuple(before))}, list[list[Candidate]](), dict[str, Fit]()
    charged = -2.0 * float(np.log(settings.prior_odds))
    for name, make in settings.of(problem, best):
        if chosen is not None and name not in chosen:
            continue
        if chosen is None and not _is_called_for(name, settings, best, fitted):
            continue
        alternative = make(fitted)
        starts = [*alternative.starts, *_start_of(alternative, earlier.get(alternative.name))]
        fits = [solve(alternative.problem, within_prior(alternative.problem, start), best.fluctuation) for start in starts]
        named = [as_alternative(fit, alternative.name, charged, settings.inflation) for fit in fits]
        found = [Candidate(alternative.problem, stronger_first(fit)) for fit in named]
        worlds.append([c for c in found if plausible(c.problem, c.fit)])
        if worlds[-1]:
            fitted[name] = min((c.fit for c in worlds[-1]), key=lambda fit: fit.minus_2_log_evidence)
    return [world for world in worlds if world]


def _is_called_for(name: str, settings: Alternatives, best: Fit, fitted: Mapping[str, Fit]) -> bool:
    """Whether a costly world is worth its fits, after those fitted so far."""
    better = [name for name, fit in fitted.items() if fit.minus_2_log_evidence < best.minus_2_log_evidence]
    if name == WORLDS["corner"]:
        return WORLDS["wall"] in better or "wall" not in settings.worlds
    vague = float(np.sqrt(np.trace(best.source_cov))) > VAGUE_M
    return name not in EXTENDED or not vague or bool(better)


def as_alternative(fit: Fit, world: str, charged: float, inflation: float) -> Fit:
    """Return the fit as one of an alternative world, which is charged its prior odds, and its covariance inflated."""
    evidence = fit.minus_2_log_evidence + charged
    return replace(fit, world=world, minus_2_log_evidence=evidence, charged=charged, cov=inflation * fit.cov, inflation=inflation)


def distinct(candidates: list[Candidate], apart_m: float, keep: float) -> list[Candidate]:
    """Return the minima of one world, best first: those farther than `apart_m` from any better one, within `keep` of the best evidence."""
    kept: list[Candidate] = []
    for c in sorted(candidates, key=lambda c: c.fit.minus_2_log_evidence):
        far = all(np.linalg.norm(c.fit.source - other.fit.source) > apart_m for other in kept)
        if far and (not kept or c.fit.minus_2_log_evidence <= kept[0].fit.minus_2_log_evidence + keep):
            kept.append(c)
    return kept


def _start_of(alternative: Alternative, earlier: Fit | None) -> list[Array]:
    """The earlier fit of the same world as a start value; changes with time begin anew, because the knots have moved."""
    if earlier is None:
        return []
    start, n = np.array(alternative.starts[0]), earlier.layout.base
    start[:n] = earlier.mean[:n]
    for i in alternative.problem.extension.shape:
        start[n + i] = earlier.mean[n + i]
    return [start]


def within_prior(problem: Problem, theta: Array) -> Array:
    """Return theta (P,) clipped to PRIOR_SDS prior standard deviations, but for the source, whose prior is a box."""
    sd = PRIOR_SDS * np.sqrt(np.diag(problem.cov))
    clipped = np.clip(theta, problem.mean - sd, problem.mean + sd)
    clipped[SOURCE] = theta[SOURCE]
    return clipped


def stronger_first(fit: Fit) -> Fit:
    """Return the fit with its two sources exchanged if the second is likelier to be the stronger.

    While that is open and one of them is vague (VAGUE_M), the better located comes first: little speaks for the strength of the other.
    """
    if fit.extension.source != TWO:
        return fit
    n = fit.layout.base
    second_cov, open_which = fit.cov[n : n + 3, n : n + 3], abs(_strength_excess(fit)) <= ONE_SIDED_95
    traces = float(np.trace(second_cov)), float(np.trace(fit.source_cov))
    vague = max(traces) > VAGUE_M**2
    exchange = traces[0] < traces[1] if open_which and vague else fit.mean[n + 3] > 0.0
    return exchanged(fit) if exchange else fit


def _strength_excess(fit: Fit) -> float:
    """ln strength of the first source over the second's, in its standard deviations."""
    n = fit.layout.base
    return -float(fit.mean[n + 3]) / float(np.sqrt(fit.cov[n + 3, n + 3]))


def exchanged(fit: Fit) -> Fit:
    """Return the fit with its two sources exchanged."""
    n = fit.layout.base
    exchange = np.eye(fit.layout.size)
    first, second = np.arange(3), n + np.arange(3)
    exchange[first, first] = exchange[second, second] = 0.0
    exchange[first, second] = exchange[second, first] = 1.0
    exchange[LN_STRENGTH, n + 3], exchange[n + 3, n + 3] = 1.0, -1.0
    return replace(fit, mean=exchange @ fit.mean, cov=exchange @ fit.cov @ exchange.T)


def extended_source(fit: Fit) -> Fit:
    """Return the fit with its covariance widened to the extent of both sources if they lie within EXTENT_M of each other.

    Two near points are also how an extended source looks, and its centre is anywhere between them: their second moment about the first,
    weighted by strength, is added.
    """
    if fit.extension.source != TWO:
        return fit
    n = fit.layout.base
    apart, weight = fit.mean[n : n + 3] - fit.source, 1.0 / (1.0 + float(np.exp(-fit.mean[n + 3])))
    if np.linalg.norm(apart) > EXTENT_M:
        return fit
    cov = np.array(fit.cov)
    cov[SOURCE, SOURCE] += weight * np.outer(apart, apart)
    return replace(fit, cov=cov)


def either_source(fit: Fit) -> tuple[Fit, ...]:
    """Return the fit, and the one with its sources exchanged while it is open which of them is the stronger (95 %).

    The exchanged one is charged the prior odds once more, so that a second source which the readings do not call for blocks nothing.
    """
    if fit.extension.source != TWO or _strength_excess(fit) > ONE_SIDED_95:
        return (fit,)
    return fit, replace(exchanged(fit), minus_2_log_evidence=fit.minus_2_log_evidence + fit.charged)


def plausible(problem: Problem, fit: Fit) -> bool:
    """Whether the source lies in the workspace box, or near it (MARGIN_M), which is where it is by definition; one or two joints cannot
    tell."""
    if problem.arm.dof < 3:
        return True
    low, high = np.array(problem.arm.box_low_m) - MARGIN_M, np.array(problem.arm.box_high_m) + MARGIN_M
    return bool(np.all(fit.source >= low) and np.all(fit.source <= high))


def into_box(problem: Problem, fit: Fit) -> Fit:
    """Return a fit with its source moved to the nearest point of the workspace box, as a start for others."""
    if plausible(problem, fit):
        return fit
    mean = np.array(fit.mean)
    mean[SOURCE] = np.clip(mean[SOURCE], problem.arm.box_low_m, problem.arm.box_high_m)
    return replace(fit, mean=mean)


def hypotheses(fits: Iterable[Fit], keep: float, separation_m: float, temper: float) -> tuple[Fit, ...]:
    """Return distinct hypotheses, best first: fits within `keep` of the least -2 ln evidence, over `temper`.

    Fits of one place (within `separation_m`) are merged: the best one, its covariance widened by the mixture's. `temper` (at least 1) is
    the overdispersion of the residuals: readings that are not independent say less than their likelihood (QAIC, Burnham & Anderson 2002).
    """
    ranked = sorted((extended_source(either) for fit in fits for either in either_source(fit)), key=lambda fit: fit.minus_2_log_evidence)
    kept: list[list[Fit]] = []
    for fit in ranked:
        if (fit.minus_2_log_evidence - ranked[0].minus_2_log_evidence) / temper > keep:
            break
        group = next((group for group in kept if np.linalg.norm(fit.source - group[0].source) <= separation_m), None)
        kept.append([fit]) if group is None else group.append(fit)
    return tuple(merged(group, temper) for group in kept)


def merged(group: list[Fit], temper: float) -> Fit:
    """Return the first fit of a group, the covariance of its source widened to the second moment of the mixture about its mean."""
    first, others = group[0], list[Fit]()
    for fit in group[1:]:
        if all(fit.world != other.world for other in (first, *others)):  # the best of each world
            others.append(fit)
    return widened(first, others, temper)


def widened(first: Fit, others: Sequence[Fit], temper: float = 1.0) -> Fit:
    """Return the first fit, the covariance of its source widened to the second moment about its mean of the mixture with the others.

    Weights are posterior probabilities: evidence to the power of 1 / temper.
    """
    excess = np.array([fit.minus_2_log_evidence - first.minus_2_log_evidence for fit in (first, *others)])
    weights = np.exp(-0.5 * excess / temper)
    weights /= np.sum(weights)
    cov = np.array(first.cov)
    for weight, fit in zip(weights[1:], others, strict=True):
        offset = fit.source - first.source
        values, axes = np.linalg.eigh(fit.source_cov - first.source_cov + np.outer(offset, offset))
        cov[SOURCE, SOURCE] += weight * (axes * np.maximum(values, 0.0)) @ axes.T
    return replace(first, cov=cov)
