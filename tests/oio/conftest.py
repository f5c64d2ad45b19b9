"""Data simulated from the filter's own model: mean field by `Problem.predict`, fluctuation and noise drawn here."""

import functools
from dataclasses import replace

import numpy as np
import pytest

from oio.core.records import GasReading, JointState, nanoseconds
from oio.gas.fluctuation import Fluctuation
from oio.gas.trace import Sniffs
from oio.inference.forward_model import ParameterLayout, Problem
from oio.inference.initial_belief import initial_belief
from oio.inference.map_fit import Fit
from oio.inference.prior import Prior, nominal_prior
from oio.inference.state_space import StateSpace
from oio.inference.uncertainty import Noise
from oio.kinematics.minimum_jerk import minimum_jerk

NOISE = Fluctuation(1.0, 0.2, 0.3)
SIGMA_PPM = 0.05
RISE_S, FALL_S = 0.4, 0.6
STEP_S, EVERY = 0.05, 2  # of the path; a reading at every second step


class Lab:
    """An arm of some DoF with a law, a prior as narrow as a calibration makes it, and traces drawn from it."""

    def __init__(self, built, dof, elements, seed=0):
        self.arm, self.elements, self.rng = built("arm", f"dof={dof}"), elements, np.random.default_rng(seed)
        self.law = replace(built("range_law"), exponent_u=0.05, wind_per_m_u=0.5, lift_per_m_u=0.3, thinning_per_m_u=0.3)
        self.nominal = replace(
            built("nominal"), rise_s=RISE_S, fall_s=FALL_S, elements=elements, sigma_ppm=SIGMA_PPM, gain_u=0.05, tau_u=0.05
        )
        self.process_noise, self.layout = built("process_noise"), ParameterLayout(dof, elements)
        self.mean, self.cov = nominal_prior(self.arm, self.law, self.nominal, np.full(elements, 0.2), np.full(elements, 0.02))
        self.model = StateSpace(
            self.arm, self.law, self.process_noise, RISE_S, FALL_S, (1.0,) * elements, NOISE, SIGMA_PPM, Noise.nominal()
        )

    @property
    def known(self):
        return Prior(self.mean, self.cov, self.model)

    def theta(self):
        """A truth drawn from the prior, its source somewhere in front of the arm and of some strength."""
        root = np.linalg.cholesky(self.cov)
        theta = self.mean + root @ self.rng.standard_normal(len(self.mean))
        theta[:3] = self.rng.uniform([0.22, -0.2, 0.1], [0.42, 0.2, 0.28])
        theta[3] = np.log(20.0) + 0.3 * self.rng.standard_normal()
        return theta

    def path(self, poses, stay_s, source):
        """Times (k,) s and joints (k, n) of poses, a second to get to each: anywhere and near the source in turn, as a search has them."""
        t = np.arange(0.0, poses * (1.0 + stay_s), STEP_S)
        goals = [self.arm.home, *(self._near(source) if i % 2 else self._off(source) for i in range(poses))]
        leg = np.minimum((t / (1.0 + stay_s)).astype(int), poses - 1)
        share = np.array([minimum_jerk(x) for x in t - leg * (1.0 + stay_s)])
        q = np.array([goals[i] + s * (goals[i + 1] - goals[i]) for i, s in zip(leg, share, strict=True)])
        return t, q

    def _off(self, source):
        while True:
            q = self.arm.random_pose(self.rng)
            if np.linalg.norm(self.arm.nose(q) - source) > 0.04:
                return q

    def _near(self, source):
        """5 to 9 cm from the source, where the arm has the joints for it."""
        for _ in range(200 if self.arm.dof >= 3 else 0):
            direction = self.rng.standard_normal(3)
            goal = source + self.rng.uniform(0.05, 0.09) * direction / np.linalg.norm(direction)
            q = self.arm.solve_ik(goal, self.arm.home)
            if q is not None:
                return q
        return self._off(source)

    def problem(self, theta, poses=8, stay_s=1.0, quiet=False, noise=NOISE):
        """The fit of a trace that theta made: MAP with the lab's prior. `quiet` leaves fluctuation and noise out."""
        t, q = self.path(poses, stay_s, theta[:3])
        lay = self.layout
        at = np.arange(0, len(t), EVERY)
        q_seen = q + theta[lay.offset] + 0.5 * t[:, None] ** 2 * theta[lay.drift]
        element = np.arange(len(at)) % self.elements
        ppm = np.full(len(at), 1.0)
        made = Problem(
            Sniffs(t, q_seen, at, t[at], element, ppm, np.full(len(at), SIGMA_PPM), np.zeros(len(at), dtype=bool)),
            self.arm, self.law, self.elements, RISE_S, FALL_S, self.mean, self.cov,
        )  # fmt: skip
        start = made.predict(theta).along.field.mean_ppm[0]  # the lag has settled where the path begins
        ppm[0] = start * np.exp(theta[lay.gain][0]) + theta[lay.baseline][0]
        expected = made.predict(theta)
        ppm = expected.ppm + theta[lay.baseline][element]
        if not quiet:
            ppm = ppm + drawn(expected.along, noise, self.rng)[0]
        return replace(made, sniffs=replace(made.sniffs, ppm=ppm))


SUB = 10  # steps of the simulation in one step of the path


def drawn(along, noise, rng, count=1, unsure=0.0):
    """What fluctuation and white noise add to the readings (count, m) ppm, in steps too small for the order of things to matter.

    `unsure`: standard deviation [ppm] of where the lag begins.
    """
    swing, rate = along.field.mean_ppm * noise.height(along.field), noise.rate(along.field)
    lagged, m, path = unsure * rng.standard_normal(count), noise.gamma * rng.standard_normal(count), []
    for dt, tau, s, r in zip(along.dt_s / SUB, along.tau_s, swing, rate, strict=True):
        keep, follow = np.exp(-dt * r), -np.expm1(-dt / tau)
        kicks = noise.gamma * np.sqrt(1.0 - keep * keep) * rng.standard_normal((SUB, count))
        for kick in kicks:
            before, m = m, keep * m + kick
            lagged = lagged + follow * (s * 0.5 * (before + m) - lagged)
        path.append(lagged)
    white = np.sqrt(noise.scale * along.variance_ppm2) * rng.standard_normal((count, len(along.at)))
    return along.gain * np.array(path)[along.at].T + white


@pytest.fixture(scope="session")
def lab(built):
    """lab(dof, elements, seed)."""
    return lambda dof=3, elements=1, seed=0: Lab(built, dof, elements, seed)


@pytest.fixture(scope="session")
def draw():
    return drawn


def searched(made, seconds_s=6.0, narrow=0.3):
    """A model and a truth, a belief `narrow` times as wide as the prior and off by as much, and (joints, reading or None) from then on.

    The source is believed within centimetres: a filter begins from a map.
    """
    theta, lay = made.theta(), made.layout
    factor = float(np.exp(theta[lay.tau]))
    gain = tuple(float(g) for g in np.exp(theta[lay.gain]))
    model = replace(made.model, gain=gain, rise_s=factor * RISE_S, fall_s=factor * FALL_S)
    sniffs = made.problem(theta, poses=3 + int(seconds_s / 2)).sniffs
    cov = narrow**2 * made.cov
    cov[:4, :4] = np.diag([1e-4, 1e-4, 1e-4, 0.04])
    off = theta + np.linalg.cholesky(cov) @ made.rng.standard_normal(lay.size)
    belief = initial_belief(model, Fit(lay, off, cov, 0.0, float(sniffs.ppm[0]), NOISE, 1, made.law), 0, 5)
    readings, out = dict(zip(sniffs.at.tolist(), range(len(sniffs.at)), strict=True)), []
    for i in np.flatnonzero((sniffs.t_s > 0.0) & (sniffs.t_s <= seconds_s)):
        t_ns, dq = nanoseconds(sniffs.t_s[i]), (sniffs.q[i] - sniffs.q[i - 1]) / STEP_S
        r = readings.get(int(i))
        reading = None if r is None else GasReading(t_ns, int(sniffs.element[r]), float(sniffs.ppm[r]), SIGMA_PPM)
        out.append((JointState(t_ns, sniffs.q[i], dq, np.zeros_like(dq)), reading))
    return model, theta, belief, out


@pytest.fixture(scope="session")
def search(lab):
    """search(dof, elements, seed): model, theta, belief and what was sensed from then on."""
    return functools.cache(lambda dof=3, elements=2, seed=0, **more: searched(lab(dof, elements, seed), **more))
