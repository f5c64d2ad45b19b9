"""The belief map: where the source may be, given a trace of readings. All distinct minima of the fit stay as hypotheses."""

import numpy as np

from oio.core.records import Array
from oio.core.settings import in_range, settings
from oio.gas.fluctuation import Fluctuation, whiten
from oio.gas.range_law import LN_STRENGTH, SOURCE, RangeLaw, Rssi
from oio.gas.trace import Sniffs, Trace
from oio.inference.forward_model import Problem
from oio.inference.map_fit import Fit, solve
from oio.inference.prior import Prior, forget_source
from oio.inference.sampling import halton
from oio.inference.trilateration import linear_source
from oio.kinematics.arm import Arm

NO_SOURCE = -60.0  # ln strength of nothing at all


@settings
class BeliefMap:
    """How the map is made: coarse places first, then a few fits."""

    path_period_s: float
    limit: int
    grid_points: int
    points_per_shell: int  # coarse places on each shell about the strongest reading
    shells_m: tuple[float, ...]  # radii of these shells
    starts: int  # of the first map
    restarts: int  # beside the hypotheses, of every later one
    min_separation_m: float
    keep_chi2: float

    def check(self) -> None:
        """Refuse senseless counts."""
        in_range(self, path_period_s=(0.01, 60), limit=(100, 10**7), grid_points=(4, 10**5), points_per_shell=(0, 10**5))
        in_range(self, starts=(1, 100), restarts=(0, 100), min_separation_m=(1e-4, 100), keep_chi2=(0, 1e6))

    def trace(self) -> Trace:
        """An empty trace."""
        return Trace(self.path_period_s, self.limit)

    def locate(self, sniffs: Sniffs, known: Prior, before: tuple[Fit, ...] = ()) -> tuple[Fit, ...]:
        """Hypotheses for the source, best first, each with its covariance; at least one.

        Hypotheses `before` are followed, coarse places all over the nose's box are tried, and the mirror point of the best: noses that
        nearly lie in a plane leave two narrow minima, of which coarse places may find the wrong one only.
        """
        problem, noise = search_problem(sniffs, known), known.model.fluctuation
        found = [solve(problem, start, noise) for start in self._starts(problem, known, before)]
        mirror = mirror_start(problem, min(found, key=lambda fit: fit.chi2).mean, noise.gamma)
        fits = sorted([*found, solve(problem, _clip_strength(problem, mirror), noise)], key=lambda fit: fit.chi2)
        kept: list[Fit] = []
        for fit in fits:
            distinct = all(np.linalg.norm(fit.source - other.source) > self.min_separation_m / 2 for other in kept)
            if distinct and fit.chi2 <= fits[0].chi2 + self.keep_chi2:
                kept.append(fit)
        return tuple(kept)

    def _starts(self, problem: Problem, known: Prior, before: tuple[Fit, ...]) -> list[Array]:
        """Where hypotheses were, and the best of coarse places and the linear solution that lie apart, each with its best strength."""
        arm, weigh = known.model.arm, known.model.fluctuation
        low, high = np.array(arm.box_low_m), np.array(arm.box_high_m)
        left = readings_without_source(problem, problem.mean)
        strongest = problem.sniffs.at[int(np.argmax(problem.residual(problem.mean, left)))]
        nose = problem.nose(problem.mean)
        near = np.concatenate([self._shells(nose[strongest]), linear_source(problem, nose)])
        places = np.concatenate([low + halton(self.grid_points) * (high - low), np.clip(near, low, high)])
        fresh = self.restarts if before else self.starts
        tried = _rank_starts(problem, places, weigh.gamma, left, 4 * fresh)
        starts = [fit.mean for fit in before]
        for theta in sorted(tried, key=lambda theta: _minus_2_log_likelihood(problem, theta, weigh)):
            if len(starts) >= fresh + len(before):
                break
            if all(np.linalg.norm(theta[SOURCE] - other[SOURCE]) > self.min_separation_m for other in starts):
                starts.append(theta)
        return starts

    def _shells(self, nose_m: Array) -> Array:
        """Places (k, 3) m about where it smelt strongest (3,) m, in all directions: minima are narrow there."""
        u = halton(self.points_per_shell)
        height, angle = 2.0 * u[:, 0] - 1.0, 2.0 * np.pi * u[:, 1]
        across = np.sqrt(1.0 - height**2)
        directions = np.stack([across * np.cos(angle), across * np.sin(angle), height], axis=1)
        return np.asarray(nose_m + np.multiply.outer(np.array(self.shells_m), directions).reshape(-1, 3))


def _rank_starts(problem: Problem, places_m: Array, gamma: float, left: Array, count: int) -> Array:
    """theta (count, P) of the best of sources at places (j, 3) m by least squares, each with its best strength: see `fit_strength`."""
    thetas = np.repeat(problem.mean[None, :], len(places_m), axis=0)
    thetas[:, SOURCE] = places_m
    z, weight = _weighted_signal(problem, problem.mean, gamma, left)
    costs, more = problem.grid_costs(thetas, left, z, weight)
    thetas[:, LN_STRENGTH] += more
    thetas = thetas[np.argsort(costs, kind="stable")[:count]]
    thetas[:, LN_STRENGTH] += problem.grid_costs(thetas, left, z, weight)[1] if count else 0.0
    return _clip_strength(problem, thetas)


def _clip_strength(problem: Problem, theta: Array) -> Array:
    """theta (..., P) with a strength that can be believed if it was told: fits that begin farther off run out of steps."""
    if problem.law.ln_strength is None:
        return theta
    out, about, u = np.array(theta), problem.mean[LN_STRENGTH], float(np.sqrt(problem.cov[LN_STRENGTH, LN_STRENGTH]))
    out[..., LN_STRENGTH] = np.clip(out[..., LN_STRENGTH], about - 2.0 * u, about + 2.0 * u)
    return out


def _minus_2_log_likelihood(problem: Problem, theta: Array, noise: Fluctuation) -> float:
    expected = problem.predict(theta, False)
    return whiten(problem.residual(theta, expected.ppm)[:, None], expected.along, noise).minus_2_log_likelihood


def search_problem(sniffs: Sniffs, known: Prior) -> Problem:
    """The fit of an unknown source; ln strength is as told, or anything about that of the largest reading at r_ref."""
    m, lay = known.model, known.layout
    above = (sniffs.ppm - known.mean[lay.baseline][sniffs.element]) / np.exp(known.mean[lay.gain])[sniffs.element]
    ln_strength = m.law.strength(max(float(np.max(above)), m.sigma_ppm))
    mean, cov = forget_source(known.mean, known.cov, m.arm, m.law, ln_strength)
    factor = float(np.exp(known.mean[lay.tau]))
    return Problem(sniffs, m.arm, m.law, m.elements, m.rise_s / factor, m.fall_s / factor, mean, cov)


def mirror_start(problem: Problem, theta: Array, gamma: float) -> Array:
    """theta (P,) with the source on the other side of the plane nearest to the noses, each weighed by what it expects to smell."""
    noses, weight = problem.nose(theta)[problem.sniffs.at], np.maximum(problem.expect(theta), 0.0) + 1e-12
    middle = weight @ noses / np.sum(weight)
    _, _, axes = np.linalg.svd(np.sqrt(weight)[:, None] * (noses - middle), full_matrices=False)
    there = np.array(theta)
    there[SOURCE] -= 2.0 * float(axes[-1] @ (theta[SOURCE] - middle)) * axes[-1]
    return fit_strength(problem, there, gamma, readings_without_source(problem, there))[1]


def readings_without_source(problem: Problem, start: Array) -> Array:
    """What is left in the readings (m,) ppm of the lag's beginning if there is no source at all."""
    nothing = np.array(start)
    nothing[LN_STRENGTH] = NO_SOURCE
    return problem.expect(nothing)


def fit_strength(problem: Problem, start: Array, gamma: float, left: Array) -> tuple[float, Array]:
    """theta (P,) with the ln strength of least squares, and the sum of squares; `left` (m,) is what does not scale with the strength.

    The rest does scale, but for which of rise and fall holds when, so the factor is found twice.
    """
    theta = np.array(start)[None, :]
    z, weight = _weighted_signal(problem, start, gamma, left)
    for _ in range(2):
        cost, more = problem.grid_costs(theta, left, z, weight)
        theta[0, LN_STRENGTH] += more[0]
    return float(cost[0]), theta[0]


def _weighted_signal(problem: Problem, theta: Array, gamma: float, left: Array) -> tuple[Array, Array]:
    """What the readings (m,) ppm are above what is `left`, and what each weighs."""
    z = problem.residual(theta, left)
    return z, 1.0 / (problem.sniffs.sigma_ppm**2 + (gamma * z) ** 2)


def range_spheres(sniffs: Sniffs, law_fit: Fit, arm: Arm, law: RangeLaw, measurements: int) -> tuple[Array, Array]:
    """Spheres of the paper: nose places (k, 3) m and ranges (k,) m of `measurements` equal parts of the readings.

    The last third of each part, when the lag has passed, becomes an RSSI, the RSSI a range by the law of `law_fit`.
    """
    lay, theta = law_fit.layout, law_fit.mean
    rssi = Rssi(1.0, law.r_ref_m, 10.0 * float(theta[lay.strength]) / np.log(10.0), float(theta[lay.exponent]))
    c = (sniffs.ppm - theta[lay.baseline][sniffs.element]) / np.exp(theta[lay.gain])[sniffs.element]
    ends = [part[-max(len(part) // 3, 1) :] for part in np.array_split(np.arange(len(c)), measurements) if len(part)]
    p = arm.nose(sniffs.q - theta[lay.offset] - 0.5 * sniffs.t_s[:, None] ** 2 * theta[lay.drift])
    levels = np.array([np.mean(c[end]) for end in ends])
    return np.array([p[sniffs.at[end[-1]]] for end in ends]), rssi.range_m(rssi.of(levels))
