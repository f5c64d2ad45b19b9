"""Laws that hold whatever the numbers: the same world elsewhere, in other units or at another rate, gives the same answer.

Those of one function alone stand beside its tests; these go through the whole fit, the whole filter or a whole search.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom, chi2

from oio.core.records import GasReading, JointState, nanoseconds
from oio.gas.fluctuation import Fluctuation
from oio.gas.whitening import whiten
from oio.inference.belief_map import search_problem
from oio.inference.bounds import cramer_rao, van_trees
from oio.inference.initial_belief import initial_belief
from oio.inference.map_fit import solve
from oio.inference.model_selection import hold_parameters
from oio.inference.prior import Prior
from oio.inference.uncertainty import type_b_of_repeats
from oio.kinematics.adjoint import AdjointChain

CALM = Fluctuation(1.0, 0.1, 0.3)


class Elsewhere:
    """The same arm seen from another frame: in other units of length, turned about the vertical, shifted."""

    def __init__(self, arm, unit=1.0, turn=0.0, shift=(0.0, 0.0, 0.0)):
        self._arm, self.dof, self._unit, self._shift = arm, arm.dof, unit, np.array(shift)
        self.turn = np.array([[np.cos(turn), -np.sin(turn), 0.0], [np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]])

    def at(self, p):
        return self._unit * p @ self.turn.T + self._shift

    def nose(self, q):
        return self.at(self._arm.nose(q))

    def nose_jacobian(self, q):
        p, jacobian = self._arm.nose_jacobian(q)
        return self.at(p), self._unit * self.turn @ jacobian

    def board(self, q, elements):
        return self.at(self._arm.board(q, elements))

    def place_of(self, elements):
        return self._arm.place_of(elements)

    def element_jacobians(self, q, elements):
        p, jacobian = self._arm.element_jacobians(q, elements)
        return self.at(p), self._unit * self.turn @ jacobian

    @property
    def spacing_m(self):
        return self._unit * self._arm.spacing_m

    @property
    def adjoints(self):
        return tuple(map(self._there, self._arm.adjoints))

    def _there(self, chain):
        turns, others, nose = (np.array(part) for part in chain)
        turns[0] = (self._unit * self.turn @ turns[0].reshape(3, 3)).ravel()
        others[0, 3:6] = self.at(others[0, 3:6])
        return AdjointChain(turns, others, nose)


def seen_from(problem, arm, unit):
    """The problem in the frame of `arm`, and how theta goes there: theta' = whole @ theta + offset."""
    whole, offset = np.eye(len(problem.mean)), np.zeros(len(problem.mean))
    whole[:3, :3], whole[5:8, 5:8], whole[8, 8] = unit * arm.turn, arm.turn / unit, 1.0 / unit
    offset[:3] = arm.at(np.zeros(3))
    lengths = {name: unit * getattr(problem.law, name) for name in ("r_ref_m", "radius_m", "nose_jitter_m")}
    law = replace(problem.law, **lengths)
    return replace(problem, arm=arm, law=law, mean=whole @ problem.mean + offset, cov=whole @ problem.cov @ whole.T), whole, offset


def same_answer(problem, start, there, whole, offset):
    """Both fits end within a hundredth of their own spread of each other, with the same covariance."""
    here, other = solve(problem, start, CALM), solve(there, whole @ start + offset, CALM)
    spread = np.sqrt(np.diag(other.cov))
    assert np.max(np.abs(whole @ here.mean + offset - other.mean) / spread) < 0.02
    assert np.max(np.abs(whole @ here.cov @ whole.T - other.cov) / np.outer(spread, spread)) < 0.02
    assert other.chi2 == pytest.approx(here.chi2, abs=1e-2)


@pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), (3.0, -20.0, 0.5)])
@pytest.mark.parametrize("turn", [0.0, 2.5])
def test_the_answer_follows_the_world(lab, turn, shift):
    made = lab(3, 2, seed=11)
    theta = made.theta()
    problem = made.problem(theta, noise=CALM)
    arm = Elsewhere(made.arm, turn=turn, shift=shift)
    same_answer(problem, theta, *seen_from(problem, arm, 1.0))


@pytest.mark.parametrize("air", ["log_distance", "isotropic"])
def test_metres_or_millimetres_find_the_same_source(lab, air):
    """In still air: the scale below which |k| is smoothed is in 1/m."""
    made = lab(3, 1, seed=12)
    made.law = replace(made.law, radius_m=5e-4, nose_jitter_m=5e-4)
    theta = made.theta()
    theta[5:8] = 0.0
    problem = hold_parameters(made.problem(theta, noise=CALM), air)
    arm = Elsewhere(made.arm, unit=1e3)
    same_answer(problem, theta, *seen_from(problem, arm, 1e3))


def in_ppb(reading):
    return replace(reading, ppm=1e3 * reading.ppm, sigma_ppm=1e3 * reading.sigma_ppm)


def searched(model, belief, estimator, path, readings):
    """The belief after predicting along path [(t_s, q, dq)] and using the readings at their times."""
    due = list(readings)
    for t_s, q, dq in path:
        joints = JointState(nanoseconds(t_s), q, dq, np.zeros(len(q)))
        belief = estimator.predict(model, belief, joints)
        while due and due[0].t_ns <= joints.t_ns:
            belief, _ = estimator.update(model, belief, due.pop(0))
    return belief


def begun(made, theta, lagged_ppm):
    """A belief a little beside the truth, as narrow as a map makes it."""
    cov = 1e-2 * np.array(made.cov)
    cov[range(4), range(4)] = np.array([0.02, 0.02, 0.02, 0.1]) ** 2
    problem = replace(made.problem(theta), mean=theta, cov=cov)
    fit = replace(solve(problem, theta, made.model.fluctuation), mean=theta, cov=cov, lagged_ppm=lagged_ppm)
    return initial_belief(made.model, fit, 0, 6)


def swept(made, rate_hz, seconds_s=4.0):
    """The shoulder swings slowly."""
    t = np.arange(1, round(seconds_s * rate_hz) + 1) / rate_hz
    q = np.tile(made.arm.home, (len(t), 1))
    q[:, 0] += 0.3 * np.sin(t)
    dq = np.zeros_like(q)
    dq[:, 0] = 0.3 * np.cos(t)
    return list(zip(t, q, dq, strict=True))


@pytest.mark.parametrize("ekf", ["ekf", "filterpy"])
def test_doubling_the_filter_rate_leaves_the_law_unchanged(lab, built, ekf):
    """Joints at 20 or 40 Hz with the same readings: within a few hundredths of the spread, and the spread by a few percent."""
    made = lab(3, 1, seed=13)
    theta, estimator = made.theta(), built("ekf", f"ekf={ekf}")
    belief = begun(made, theta, 15.0)
    readings = [GasReading(nanoseconds(0.5 * i), 0, 15.0 + np.sin(i), 0.05) for i in range(1, 8)]
    slow, fast = (searched(made.model, belief, estimator, swept(made, rate), readings) for rate in (20.0, 40.0))
    kept = np.arange(made.model.size) != made.model.at["m"].start
    spread = np.sqrt(np.diag(fast.cov))
    assert np.max((np.abs(slow.mean - fast.mean) / spread)[kept]) < 0.1
    np.testing.assert_allclose(np.sqrt(np.diag(slow.cov))[kept], spread[kept], rtol=0.05)


def test_ppm_or_ppb_are_the_same_to_the_filter(lab, built):
    made, estimator = lab(3, 2, seed=14), built("ekf")
    theta, at = made.theta(), made.model.at
    belief, scale = begun(made, theta, 15.0), np.ones(made.model.size)
    scale[at["b"]] = scale[at["f"]] = 1e3
    model = replace(made.model, sigma_ppm=1e3 * made.model.sigma_ppm)
    shift = np.zeros(made.model.size)
    shift[at["l"]] = np.log(1e3)
    there = replace(belief, mean=scale * belief.mean + shift, cov=np.outer(scale, scale) * belief.cov)
    readings = [GasReading(nanoseconds(0.5 * i), i % 2, 15.0 + np.sin(i), 0.05) for i in range(1, 8)]
    path = swept(made, 20.0)
    here, other = searched(made.model, belief, estimator, path, readings), searched(model, there, estimator, path, map(in_ppb, readings))
    spread = np.sqrt(np.diag(other.cov))
    assert np.max(np.abs(scale * here.mean + shift - other.mean) / spread) < 1e-3
    assert np.max(np.abs(np.outer(scale, scale) * here.cov - other.cov) / np.outer(spread, spread)) < 1e-3


def test_half_of_every_uncertainty_is_half_the_bound(lab):
    """All the way to the source, Type A and Type B alike."""
    made = lab(3, 2, seed=15)
    made.law = replace(made.law, nose_jitter_m=1e-6, model_discrepancy=0.0)
    made.model = replace(made.model, law=made.law)
    theta = made.theta()
    sniffs = made.problem(theta, poses=12).sniffs
    half = replace(made.model, fluctuation=replace(made.model.fluctuation, scale=0.25, gamma=0.5 * made.model.fluctuation.gamma))
    known, better = made.known, Prior(made.mean, 0.25 * made.cov, half)
    assert cramer_rao(sniffs, better, theta).rms_m == pytest.approx(0.5 * cramer_rao(sniffs, known, theta).rms_m, rel=1e-4)


CALIBRATIONS, PATHS = 600, 4


class Repeats:
    """Own-model readings along a few paths, so often that a calibration may repeat each up to four times; what they tell to first order."""

    def __init__(self, made, theta, draw):
        self.of_law, self.of_source, self.law, self.misses_m, self.nees = np.zeros((2, 2)), [], [], [], []
        for _ in range(PATHS):
            problem, noise = made.problem(theta, poses=5), made.model.fluctuation
            expected = problem.predict(theta)
            z = draw(expected.along, noise, made.rng, 4 * CALIBRATIONS)
            white = whiten(np.concatenate([z.T, expected.rows], axis=1), expected.along, noise).rows
            self._add(white[:, : len(z)], white[:, len(z) :], made.cov)

    def _add(self, z, rows, prior):
        """The beacon tells strength and exponent, its place is known; a repeat finds the place, and the strength with it."""
        law, both = rows[:, 3:5], rows[:, :4]
        self.of_law += law.T @ law
        self.law.append((law.T @ z).reshape(2, CALIBRATIONS, 4))
        cov = np.linalg.inv(both.T @ both + np.linalg.inv(prior[:4, :4]))
        off = (cov @ both.T @ z)[:3]
        self.misses_m.append(np.linalg.norm(off, axis=0).reshape(CALIBRATIONS, 4))
        self.nees.append(np.sum(off * np.linalg.solve(cov[:3, :3], off), axis=0).reshape(CALIBRATIONS, 4))

    def beacon(self, times):
        """Errors (CALIBRATIONS, 2) of the fit of ln strength and exponent on every path so many times."""
        told = sum(part[:, :, :times].sum(axis=2) for part in self.law)
        return np.linalg.solve(times * self.of_law, told).T

    def u_b_m(self, times):
        """Type B (CALIBRATIONS,) of every path so many times."""
        misses_m, nees = (np.concatenate([part[:, :times] for part in parts], axis=1) for parts in (self.misses_m, self.nees))
        return np.array([type_b_of_repeats(v, e, (4,) * len(v), np.zeros(len(v))).u_b_m for v, e in zip(misses_m, nees, strict=True)])


def test_sixteen_repeats_instead_of_four_halve_what_the_beacon_leaves_open(lab, draw):
    """Standard errors over many calibrations, of the fit and of u_b; that of the fit is also what its covariance says."""
    made = lab(3, 1, seed=16)
    made.law = replace(made.law, nose_jitter_m=1e-6, model_discrepancy=0.0)
    made.model = replace(made.model, law=made.law)
    repeats = Repeats(made, made.theta(), draw)
    few, many = (np.std(repeats.beacon(times), axis=0) for times in (1, 4))
    np.testing.assert_allclose(few, np.sqrt(np.diag(np.linalg.inv(repeats.of_law))), rtol=0.1)
    np.testing.assert_allclose(many / few, 0.5, rtol=0.1)
    assert np.std(repeats.u_b_m(4)) / np.std(repeats.u_b_m(1)) == pytest.approx(0.5, rel=0.1)
    assert np.mean(repeats.u_b_m(4)) == pytest.approx(np.mean(repeats.u_b_m(1)), rel=0.05)  # itself it does not become less


SEARCHES = 40


@pytest.fixture(scope="module")
def many(lab, built):
    """Own-model searches: (truth (3,), the fit begun at the truth, hypotheses of a map made from nothing, van Trees' covariance)."""
    out, belief_map = [], built("belief_map")
    for seed in range(SEARCHES):
        made = lab(3, 1, seed=700 + seed)
        made.law = replace(made.law, model_discrepancy=0.0)  # its plumes are the law's, and the covariance is to say no more than that
        made.model = replace(made.model, law=made.law)
        theta = made.theta()
        sniffs = made.problem(theta, poses=10).sniffs
        fit = solve(search_problem(sniffs, made.known), theta, made.model.fluctuation)
        out.append((theta[:3], fit, belief_map.locate(sniffs, made.known), van_trees(sniffs, made.known, theta).cov))
    return out


def nees(fit, truth):
    error = fit.mean[:3] - truth
    return float(error @ np.linalg.solve(fit.cov[:3, :3], error))


@pytest.mark.slow
def test_the_covariance_of_the_fit_is_right(many):
    """NEES of the source in its 99.8 % band of 40 draws (Bar-Shalom, Li, Kirubarajan 2001, 5.4)."""
    values = [nees(fit, truth) for truth, fit, _, _ in many]
    low, high = chi2.ppf([1e-3, 1 - 1e-3], 3 * SEARCHES) / SEARCHES
    assert low < np.mean(values) < high, np.mean(values)


@pytest.mark.slow
def test_the_hypotheses_hold_the_truth_as_often_as_they_say(many):
    """In the 95 % region of one of them: fewer than the 0.1 % quantile of a binomial would be dishonest."""
    inside = sum(any(nees(fit, truth) < chi2.ppf(0.95, 3) for fit in fits) for truth, _, fits, _ in many)
    assert inside >= binom.ppf(1e-3, SEARCHES, 0.95), inside


@pytest.mark.slow
def test_no_fit_beats_the_bound_and_few_maps_miss_it(many):
    """Errors in units of the posterior bound: an RMS below 0.8 would be truth that leaked."""
    fits = [np.linalg.norm(fit.mean[:3] - truth) ** 2 / np.trace(cov) for truth, fit, _, cov in many]
    assert 0.8 < np.sqrt(np.mean(fits)) < 1.25, np.sqrt(np.mean(fits))
    maps = [np.linalg.norm(found[0].mean[:3] - truth) ** 2 / np.trace(cov) for truth, _, found, cov in many]
    assert np.quantile(np.sqrt(maps), 0.8) < 1.6, np.sqrt(maps)
