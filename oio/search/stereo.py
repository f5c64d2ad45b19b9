"""Stereo search (tropotaxis): the slope of ln c from the difference of two elements of the board and from the sniffs before it.

A pair at p_0 and p_1 tells ln c_0 - ln c_1 = g . (p_0 - p_1), sniffs at p and at the best place ln c - ln c_best = g . (p - p_best). Each
has a variance, of sensor, fluctuation and the law's curvature, so the slope g has a posterior (linear regression with a normal prior).
The next sniff is one step up g if that is significant, else one step where g is known least. Of the poses that have the nose there,
that is taken in which the board lies across g, in the direction that is known least: there the pair tells what a step does not.
With one place of both elements only the sniffs are left. Bilateral comparison: Fraenkel & Gunn 1940; Martinez et al. 2006 in robots.
"""

from typing import Annotated

import numpy as np

from oio.core.records import Array
from oio.core.settings import Within, refuse_below, settings
from oio.search.gradient import climbed
from oio.search.sniff_history import SniffHistory, joint_offsets, sniff_history
from oio.search.step_planning import box_diagonal_m, is_allowed, step_toward, tangent_directions
from oio.search.view import View


@settings
class Stereo:
    """Gradient ascent with the difference of a pair; lengths are fractions of the diagonal of the nose's workspace box."""

    fit_sniffs: Annotated[int, Within(4, 1000)]  # number of latest sniffs in the fit; the best one of them is the base point
    step: Annotated[float, Within(1e-4, 1)]  # largest step
    min_step: Annotated[float, Within(1e-4, 1)]  # smallest step
    step_factor: Annotated[float, Within(0.1, 1)]  # factor on the step after a move without gain; a gain divides by it
    slope_sd: Annotated[float, Within(1e-3, 100)]  # of the prior: ln c over one step of 10 cm, on each axis
    curvature: Annotated[float, Within(0, 100)]  # by which ln c leaves a plane 10 cm off, standard deviation
    significance: Annotated[float, Within(0, 10)]  # a slope is one if it is so many standard deviations
    orientations: Annotated[int, Within(0, 1000)]  # poses tried for the board at the next place

    def check(self) -> None:
        """Raise BadInput for a first step below the shortest."""
        refuse_below(self, "step", "min_step")

    def propose(self, view: View, rng: np.random.Generator) -> Array:
        """Return the next joint goal (n,) rad."""
        history = sniff_history(view)
        if len(history.ppm) == 0:
            slope, cov, at, step, q = np.zeros(3), np.eye(3), view.arm.nose(view.arm.home), self.step, view.arm.home
        else:
            y = np.log(np.maximum(history.ppm, view.model.sigma_ppm))[-self.fit_sniffs :]
            best, step = climbed(y, self.step, self.min_step, self.step_factor)
            slope, cov = self.slope(view, history, best)
            at, q = history.p_m[-self.fit_sniffs :][best], history.q[-self.fit_sniffs :][best]
        tangents = tangent_directions(view, q)
        direction = self.direction(tangents.T @ slope, tangents.T @ cov @ tangents, rng)
        goal = step_toward(view, at + step * box_diagonal_m(view) * (tangents @ direction), rng)
        return self._turned(view, goal, tangents @ direction, cov, rng)

    def slope(self, view: View, history: SniffHistory, best: int) -> tuple[Array, Array]:
        """Posterior of the slope of ln c at the best of the latest sniffs: mean (3,) and covariance (3, 3), per UNIT_M."""
        p, ppm, pair = (a[-self.fit_sniffs :] for a in (history.p_m, history.ppm, history.pair_ppm))
        x, (fluctuation, between) = (p - p[best]) / UNIT_M, _fluctuation(view)
        far, white = np.linalg.norm(x, axis=1), _relative_variance(view, ppm) / len(view.model.gain)
        y, others = np.log(np.maximum(ppm, view.model.sigma_ppm)), np.arange(len(p)) != best
        variance = white + white[best] + 2.0 * fluctuation + (self.curvature * far**2) ** 2
        rows, values, variances = [x[others]], [(y - y[best])[others]], [variance[others]]
        told = np.all(np.isfinite(pair), axis=1)
        if np.any(told):
            ends, _ = view.arm.element_jacobians(history.q[-self.fit_sniffs :][told] - joint_offsets(view), 2)
            apart = (ends[0] - ends[1]) / UNIT_M
            logs = np.log(np.maximum(pair[told], view.model.sigma_ppm))
            bent = (2.0 * self.curvature * far[told] * np.linalg.norm(apart, axis=1)) ** 2
            rows.append(apart)
            values.append(logs[:, 0] - logs[:, 1])
            variances.append(np.sum(_relative_variance(view, pair[told]), axis=1) + between + bent)
        a, z, w = np.concatenate(rows), np.concatenate(values), 1.0 / np.concatenate(variances)
        cov = np.linalg.inv(np.eye(3) / self.slope_sd**2 + (w * a.T) @ a)
        return cov @ (a.T @ (w * z)), cov

    def direction(self, slope: Array, cov: Array, rng: np.random.Generator) -> Array:
        """Unit vector (r,) up a slope (r,) that is significant by its covariance (r, r); else the one along which it is known least."""
        steepness = float(np.linalg.norm(slope))
        if steepness > 1e-9 and steepness**2 > self.significance**2 * float(slope @ cov @ slope) / steepness**2:
            return np.asarray(slope / steepness)
        axis = np.linalg.eigh(cov + 1e-9 * np.diag(rng.random(len(cov))))[1][:, -1]
        side = float(axis @ slope)
        return np.asarray(axis * (np.sign(side) if abs(side) > 1e-9 else rng.choice([-1.0, 1.0])))

    def _turned(self, view: View, goal: Array, direction: Array, cov: Array, rng: np.random.Generator) -> Array:
        """Of poses with the nose as at goal (n,), that whose board lies across the direction, where the slope is known least."""
        arm, o = view.arm, joint_offsets(view)
        if arm.place_of(len(view.model.gain))[-1] == 0 or arm.dof <= 3 or self.orientations == 0:
            return goal
        starts = np.clip(
            goal + SPREAD * (arm.high_rad - arm.low_rad) * rng.standard_normal((self.orientations, arm.dof)), arm.low_rad, arm.high_rad
        )
        place = np.repeat(arm.nose(goal - o)[None], self.orientations, axis=0)
        poses, reached = arm.solve_ik_all(place, starts - o)
        poses = np.concatenate([goal[None], poses[reached] + o])
        ends, _ = arm.element_jacobians(poses - o, 2)
        apart = ends[0] - ends[1]
        across = apart - np.outer(apart @ direction, direction)
        told = np.einsum("ij,jk,ik->i", across, cov, across)
        for i in np.argsort(-told, kind="stable"):
            if i == 0 or is_allowed(view, poses[i]):
                return np.asarray(poses[i])
        return goal


UNIT_M = 0.1  # unit of length of the slope
SPREAD = 0.25  # of the start poses, as a share of the range of every joint


def _relative_variance(view: View, ppm: Array) -> Array:
    """Variance of ln of signals by the white noise of one reading."""
    return np.asarray((view.model.sigma_ppm / np.maximum(ppm, view.model.sigma_ppm)) ** 2)


def _fluctuation(view: View) -> tuple[float, float]:
    """Variance of ln c by the gas's fluctuation during a dwell, and of its difference between the two places: as at r_ref."""
    fl, r_ref_m = view.model.fluctuation, view.model.law.r_ref_m
    variance = fl.gamma**2 / max(view.dwell_s / fl.t_s, 1.0)
    return variance, 2.0 * variance * (1.0 - float(np.exp(-view.arm.spacing_m / r_ref_m)))
