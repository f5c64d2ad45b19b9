"""Belief map: hypotheses for the source position from a trace of readings, one per distinct minimum of the fit."""

from dataclasses import replace
from typing import Annotated

import numpy as np

from oio.core.records import Array
from oio.core.settings import Within, settings
from oio.gas.fluctuation import Fluctuation
from oio.gas.range_law import LN_STRENGTH, SOURCE
from oio.gas.trace import Sniffs, Trace
from oio.gas.whitening import whiten
from oio.inference.alternatives import Alternatives
from oio.inference.forward_model import Problem
from oio.inference.map_fit import Fit, solve
from oio.inference.prior import Prior, reset_source
from oio.inference.residual_test import Candidate, residual_test, split_half, with_raised_noise
from oio.inference.sampling import halton
from oio.inference.source_strength import clip_strength, mirror_start, readings_without_source, weighted_signal
from oio.inference.trilateration import linear_source
from oio.inference.world_posterior import distinct, fit_alternatives, hypotheses, into_box, plausible, within_prior


@settings
class BeliefMap:
    """Settings of the belief map: a coarse grid of source positions, then a few fits from the best."""

    path_period_s: Annotated[float, Within(0.01, 60)]
    limit: Annotated[int, Within(100, 10_000_000)]
    grid_points: Annotated[int, Within(4, 100_000)]
    points_per_shell: Annotated[int, Within(0, 100_000)]  # grid positions on each shell about the strongest reading
    shells_m: Annotated[tuple[float, ...], Within(1e-3, 10)]  # radii of these shells
    starts: Annotated[int, Within(1, 100)]  # fits of the first map
    restarts: Annotated[int, Within(0, 100)]  # fits of every later map, besides one per hypothesis
    min_separation_m: Annotated[float, Within(1e-4, 100)]
    keep_chi2: Annotated[float, Within(0, 1e6)]
    alternatives: Alternatives
    raise_min_evidence: Annotated[float, Within(0, 1e6)]
    # suspect_overdispersion: of the residuals in the calibrated world, above which every alternative is fitted
    suspect_overdispersion: Annotated[float, Within(1, 1e6)]

    def trace(self) -> Trace:
        """Return an empty trace."""
        return Trace(self.path_period_s, self.limit)

    @property
    def as_calibrated(self) -> "BeliefMap":
        """The same map without alternatives to the calibrated world."""
        return replace(self, alternatives=self.alternatives.none)

    def locate(self, sniffs: Sniffs, known: Prior, before: tuple[Fit, ...] = (), thorough: bool = True) -> tuple[Fit, ...]:
        """Return hypotheses for the source, best first, each with its covariance; at least one.

        Earlier hypotheses (`before`) are refitted; grid positions all over the workspace box are tried, and the mirror point of the best
        fit: nose positions near a plane leave two narrow minima, and the grid may find only the wrong one. Worlds that calibration did
        not see are fitted beside it (`alternatives`), and compared by evidence: all of them if `thorough`, or if the residuals of the
        calibrated world contradict it; else those of the earlier hypotheses.
        """
        problem = search_problem(sniffs, known)
        kept = self._as_calibrated(problem, known, before)
        if not self.alternatives.worlds or known.model.arm.dof < 3:
            return (replace(kept[0], residuals=residual_test(problem, kept[0])), *kept[1:])
        everything = thorough or residual_test(problem, kept[0]).overdispersion > self.suspect_overdispersion
        chosen = None if everything else {fit.world for fit in before}
        alternatives = fit_alternatives(self.alternatives, problem, into_box(problem, kept[0]), before, chosen)
        worlds = [[Candidate(problem, fit) for fit in kept], *alternatives]
        candidates = [
            c for world in worlds for c in with_raised_noise(distinct(world, self._apart_m, self.keep_chi2), self.raise_min_evidence)
        ]
        best = min(candidates, key=lambda c: c.fit.minus_2_log_evidence)
        if not plausible(best.problem, best.fit):
            candidates = [c for c in candidates if plausible(c.problem, c.fit)] or candidates
            best = min(candidates, key=lambda c: c.fit.minus_2_log_evidence)
        residuals = residual_test(best.problem, best.fit)
        if thorough:
            residuals = replace(residuals, halves=split_half(best.problem, best.fit))
        first, *others = hypotheses([c.fit for c in candidates], self.keep_chi2, self._apart_m, residuals.overdispersion)
        return (replace(first, residuals=residuals), *others)

    @property
    def _apart_m(self) -> float:
        """Distance above which two minima are two hypotheses."""
        return self.min_separation_m / 2

    def _as_calibrated(self, problem: Problem, known: Prior, before: tuple[Fit, ...]) -> tuple[Fit, ...]:
        """Hypotheses in the world that calibration saw. The best is out of reach (`plausible`) only if all are."""
        noise = known.model.fluctuation
        found = [solve(problem, start, noise) for start in self._starts(problem, known, before)]
        mirror = mirror_start(problem, min(found, key=lambda fit: fit.chi2).mean, noise.gamma)
        fits = sorted([*found, solve(problem, clip_strength(problem, mirror), noise)], key=lambda fit: fit.chi2)
        if not plausible(problem, fits[0]):
            fits = [fit for fit in fits if plausible(problem, fit)] or fits
        kept: list[Fit] = []
        for fit in fits:
            distinct = all(np.linalg.norm(fit.source - other.source) > self.min_separation_m / 2 for other in kept)
            if distinct and fit.chi2 <= fits[0].chi2 + self.keep_chi2:
                kept.append(fit)
        return tuple(kept)

    def _starts(self, problem: Problem, known: Prior, before: tuple[Fit, ...]) -> list[Array]:
        """Start values: earlier hypotheses, then the best separated grid positions and linear solution, each with its best strength."""
        arm, noise = known.model.arm, known.model.fluctuation
        low, high = np.array(arm.box_low_m), np.array(arm.box_high_m)
        decay = readings_without_source(problem, problem.mean)
        strongest = problem.sniffs.at[int(np.argmax(problem.residual(problem.mean, decay)))]
        nose = problem.nose(problem.mean)
        near = np.concatenate([self._shells(nose[strongest]), linear_source(problem, nose)])
        positions = np.concatenate([low + halton(self.grid_points) * (high - low), np.clip(near, low, high)])
        new_starts = self.restarts if before else self.starts
        candidates = _rank_starts(problem, positions, noise.gamma, decay, 4 * new_starts)
        starts = [within_prior(problem, fit.mean[: problem.layout.base]) for fit in before]
        for theta in sorted(candidates, key=lambda theta: _minus_2_log_likelihood(problem, theta, noise)):
            if len(starts) >= new_starts + len(before):
                break
            if all(np.linalg.norm(theta[SOURCE] - other[SOURCE]) > self.min_separation_m for other in starts):
                starts.append(theta)
        return starts

    def _shells(self, nose_m: Array) -> Array:
        """Grid positions (k, 3) [m] on shells about the strongest reading at (3,) [m]: minima are narrow there."""
        u = halton(self.points_per_shell)
        height, angle = 2.0 * u[:, 0] - 1.0, 2.0 * np.pi * u[:, 1]
        across = np.sqrt(1.0 - height**2)
        directions = np.stack([across * np.cos(angle), across * np.sin(angle), height], axis=1)
        return np.asarray(nose_m + np.multiply.outer(np.array(self.shells_m), directions).reshape(-1, 3))


def _rank_starts(problem: Problem, positions_m: Array, gamma: float, decay: Array, count: int) -> Array:
    """theta (count, P) of the best sources at positions (j, 3) [m] by least squares, each with its best strength: see `fit_strength`."""
    thetas = np.repeat(problem.mean[None, :], len(positions_m), axis=0)
    thetas[:, SOURCE] = positions_m
    z, weight = weighted_signal(problem, problem.mean, gamma, decay)
    costs, ln_factor = problem.grid_costs(thetas, decay, z, weight)
    thetas[:, LN_STRENGTH] += ln_factor
    thetas = thetas[np.argsort(costs, kind="stable")[:count]]
    thetas[:, LN_STRENGTH] += problem.grid_costs(thetas, decay, z, weight)[1] if count else 0.0
    return clip_strength(problem, thetas)


def _minus_2_log_likelihood(problem: Problem, theta: Array, noise: Fluctuation) -> float:
    expected = problem.predict(theta, False)
    return whiten(problem.residual(theta, expected.ppm)[:, None], expected.along, noise).minus_2_log_likelihood


def search_problem(sniffs: Sniffs, known: Prior) -> Problem:
    """Fit problem of an unknown source; the prior of ln strength is as configured, or centred on the largest reading."""
    model, lay = known.model, known.layout
    signal = (sniffs.ppm - known.mean[lay.baseline][sniffs.element]) / np.exp(known.mean[lay.gain])[sniffs.element]
    ln_strength = model.law.strength(max(float(np.max(signal)), model.sigma_ppm))
    mean, cov = reset_source(known.mean, known.cov, model.arm, model.law, ln_strength)
    factor = float(np.exp(known.mean[lay.tau]))
    return Problem(sniffs, model.arm, model.law, model.elements, model.rise_s / factor, model.fall_s / factor, mean, cov)
