"""D-optimal search (optimal experimental design): the next sniff is expected to shrink the source's covariance most per second.

Candidates are poses about every hypothesis, at a few distances, and random poses while the source is poorly known. A sniff at a
candidate is one measurement of ln c with variance gamma^2 I / n + (sigma / c)^2, n the number of eddies that pass during the dwell; the
posterior of the source under it is a rank-one update of the belief. While several hypotheses are left, the difference of their
predictions counts as well (in units of that variance). Elements at two places make two measurements, whose fluctuations are correlated.
"""

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from oio.core.records import Array
from oio.core.settings import Within, settings
from oio.gas.range_law import LAW, SOURCE, WIND, concentration
from oio.search.exploration import explore
from oio.search.view import View

NO_GAS = 1e-6  # concentrations below so many standard deviations of a reading are none: their logarithms say nothing


@settings
class DOptimal:
    """D-optimal strategy: explore until there is a belief, then maximise expected information per second."""

    local_candidates: Annotated[int, Within(0, 10_000)]  # candidates about each hypothesis
    random_candidates: Annotated[int, Within(1, 10_000)]  # random candidates,
    # random_above_sd_m: while the source's sd (root of the trace) is above this: far off no plume model is as accurate
    random_above_sd_m: Annotated[float, Within(0, 100)]
    distances_m: Annotated[tuple[float, ...], Within(1e-3, 10)]  # from a hypothesis
    # ik_start_spread_rad: spread of the start joints of the inverse kinematics: one position is reached by many poses
    ik_start_spread_rad: Annotated[float, Within(0, 3)]

    def propose(self, view: View, rng: np.random.Generator) -> Array:
        """Return the next joint goal (n,) rad."""
        if view.belief is None:
            return explore(view, rng)
        candidates = self._candidates(view, rng)
        q_now = view.moves[-1].q if view.moves else view.arm.home
        cost_s = view.arm.duration_s(q_now, candidates) + view.dwell_s
        return np.asarray(candidates[int(np.argmax(expected_information(view, candidates) / cost_s))])

    def _candidates(self, view: View, rng: np.random.Generator) -> Array:
        near = [self._about(view, place, rng) for place in source_hypotheses(view)] if view.arm.dof >= 3 and self.local_candidates else []
        poses = np.concatenate([np.empty((0, view.arm.dof)), *near])
        clear = poses[path_is_clear(view, poses)]
        if len(clear) and sd_m(view) <= self.random_above_sd_m:
            return clear
        far = view.arm.random_poses(rng, self.random_candidates)
        clear = np.concatenate([clear, far[path_is_clear(view, far)]])
        return clear if len(clear) else far[:1]

    def _about(self, view: View, place: Array, rng: np.random.Generator) -> Array:
        """Poses (k, n) with the nose at one of the distances from place (3,) m, each solved from another start pose."""
        direction = rng.standard_normal((self.local_candidates, 3))
        distance = rng.choice(self.distances_m, (self.local_candidates, 1))
        goals = place + distance * direction / np.linalg.norm(direction, axis=1, keepdims=True)
        q_now = view.moves[-1].q if view.moves else view.arm.home
        starts = np.clip(
            q_now + self.ik_start_spread_rad * rng.standard_normal((self.local_candidates, len(q_now))), view.arm.low_rad, view.arm.high_rad
        )
        poses, reached = view.arm.solve_ik_all(goals, starts)
        return np.asarray(poses[reached])


def source_hypotheses(view: View) -> list[Array]:
    """Return the source positions (3,) m of all hypotheses, the filter's estimate first."""
    assert view.belief is not None
    return [view.belief.mean[view.model.at["s"]], *(fit.source for fit in view.hypotheses[1:])]


def sd_m(view: View) -> float:
    """Return the standard deviation of the believed source: root of the trace of its covariance [m]."""
    assert view.belief is not None
    s = view.model.at["s"]
    return float(np.sqrt(np.trace(view.belief.cov[s, s])))


def path_is_clear(view: View, q: Array) -> NDArray[np.bool_]:
    """Return whether the path to q (k, n) keeps the nose in its workspace box and the stand-off distance from the believed source: (k,)."""
    q_now = view.moves[-1].q if view.moves else view.arm.home
    off = view.arm.clearance_m(q_now, q, source_hypotheses(view)[0]) >= view.standoff_m
    return np.asarray(off & view.arm.path_is_free(q_now, q))


def expected_information(view: View, candidates: Array) -> Array:
    """Return the expected gain (k,) of ln det of the source's precision from a sniff at candidates (k, n), plus that about hypotheses."""
    assert view.belief is not None
    model, x, cov = view.model, view.belief.mean, view.belief.cov
    if model.places == 2:
        return _information_of_pair(view, candidates)
    at, s = model.at, model.at["s"].start
    p, jac = model.arm.nose_jacobian(candidates - x[at["o"]])
    c, grad, r, rarity = concentration(p, x[s : s + LAW], model.law.r_ref_m, model.law.radius_m)
    variance = _variance(view, c, r, rarity, grad[:, WIND])
    rows = np.zeros((len(candidates), model.size))
    rows[:, s : s + LAW] = grad
    rows[:, at["o"]] = np.einsum("ij,ijk->ik", grad[:, SOURCE], jac)
    ph = rows @ cov  # (k, N)
    innovation_variance = np.einsum("ij,ij->i", ph, rows) + variance
    prior = cov[at["s"], at["s"]]
    reduction = np.einsum("ij,jk,ik->i", ph[:, at["s"]], np.linalg.inv(prior), ph[:, at["s"]]) / innovation_variance
    gain = -np.log(np.maximum(1.0 - reduction, 1e-9))  # det(P - v v'/S) = det P (1 - v' P^-1 v / S)
    least = NO_GAS * model.sigma_ppm
    for other in view.hypotheses[1:]:
        c_other, _, _, _ = concentration(p, other.mean[:LAW], model.law.r_ref_m, model.law.radius_m)
        gain = gain + np.log1p(np.log(np.maximum(c_other, least) / np.maximum(c, least)) ** 2 / variance)
    return np.asarray(gain)


def _information_of_pair(view: View, candidates: Array) -> Array:
    """The same (k,) for elements at two places."""
    assert view.belief is not None
    model, x, cov = view.model, view.belief.mean, view.belief.cov
    at, s, least = model.at, model.at["s"].start, NO_GAS * model.sigma_ppm
    p, jac = model.arm.element_jacobians(candidates - x[at["o"]], model.elements)
    fields = [concentration(place, x[s : s + LAW], model.law.r_ref_m, model.law.radius_m) for place in p]
    rows = np.zeros((len(candidates), 2, model.size))
    rows[:, :, s : s + LAW] = np.stack([grad for _, grad, _, _ in fields], axis=1)
    rows[:, :, at["o"]] = np.einsum("kea,ekaj->kej", rows[:, :, s + SOURCE.start : s + SOURCE.stop], jac)
    parts = [_variances(view, c, r, rarity, grad[:, WIND]) for c, grad, r, rarity in fields]
    swing = np.sqrt(np.stack([fluctuation for fluctuation, _ in parts], axis=1))
    rho = np.exp(-2.0 * model.arm.spacing_m / (fields[0][2] + fields[1][2]))
    noise = swing[:, :, None] * swing[:, None, :]
    noise[:, 0, 1] *= rho
    noise[:, 1, 0] *= rho
    noise[:, [0, 1], [0, 1]] += np.stack([white for _, white in parts], axis=1)
    ph = rows @ cov
    told = ph[:, :, at["s"]]
    innovation = ph @ rows.transpose(0, 2, 1) + noise
    left = np.eye(2) - np.linalg.solve(innovation, told @ np.linalg.inv(cov[at["s"], at["s"]]) @ told.transpose(0, 2, 1))
    gain = -np.log(np.maximum(np.linalg.det(left), 1e-9))
    expected = np.log(np.maximum(np.stack([c for c, _, _, _ in fields], axis=1), least))
    for other in view.hypotheses[1:]:
        there = [concentration(place, other.mean[:LAW], model.law.r_ref_m, model.law.radius_m)[0] for place in p]
        apart = np.log(np.maximum(np.stack(there, axis=1), least)) - expected
        gain = gain + np.log1p(np.einsum("ke,ke->k", apart, np.linalg.solve(noise, apart[:, :, None])[:, :, 0]))
    return np.asarray(gain)


def _variance(view: View, c: Array, r: Array, rarity: Array, by_wind_m: Array) -> Array:
    """Variance (k,) of one measurement of ln c during a dwell: gas fluctuation and sensor noise."""
    fluctuation, white = _variances(view, c, r, rarity, by_wind_m)
    return fluctuation + white


def _variances(view: View, c: Array, r: Array, rarity: Array, by_wind_m: Array) -> tuple[Array, Array]:
    """The two parts of `_variance`."""
    assert view.belief is not None
    fl, exponent = view.model.fluctuation, float(view.belief.mean[view.model.at["n"]][0])
    field = view.model.law.field(c, rarity, r, np.zeros_like(r), exponent, by_wind_m)
    eddies = np.maximum(view.dwell_s * fl.rate(field), 1.0)
    white = (view.model.sigma_ppm / np.maximum(c, NO_GAS * view.model.sigma_ppm)) ** 2
    return (fl.gamma * fl.height(field)) ** 2 / eddies, np.asarray(white)
