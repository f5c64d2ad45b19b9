"""Data simulated from the filter's own model: mean field by `Problem.predict`, fluctuation and noise drawn here."""

from dataclasses import replace

import numpy as np
import pytest

from oio.arm import smooth
from oio.batch import Layout, Problem
from oio.fluctuation import Fluctuation
from oio.knowledge import Knowledge, prior
from oio.model import Model
from oio.trace import Sniffs
from oio.uncertainty import Noise

NOISE = Fluctuation(1.0, 0.2, 0.3)
SIGMA_PPM = 0.05
RISE_S, FALL_S = 0.4, 0.6
STEP_S, EVERY = 0.05, 2  # of the path; a reading at every second step


class Lab:
    """An arm of some DoF with a law, a prior as narrow as a calibration makes it, and traces drawn from it."""

    def __init__(self, built, dof, elements, seed=0):
        self.arm, self.elements, self.rng = built("arm", f"dof={dof}"), elements, np.random.default_rng(seed)
        self.law = replace(built("range"), exponent_u=0.05, wind_per_m_u=0.5, lift_per_m_u=0.3, thinning_per_m_u=0.3)
        self.nominal = replace(built("nominal"), rise_s=RISE_S, fall_s=FALL_S, elements=elements, sigma_ppm=SIGMA_PPM, gain_u=0.05, tau_u=0.05)
        self.wander, self.layout = built("wander"), Layout(dof, elements)
        self.mean, self.cov = prior(self.arm, self.law, self.nominal, np.full(elements, 0.2), np.full(elements, 0.02))
        self.model = Model(self.arm, self.law, self.wander, RISE_S, FALL_S, (1.0,) * elements, NOISE, SIGMA_PPM, Noise.nominal())

    @property
    def known(self):
        return Knowledge(self.mean, self.cov, self.model)

    def theta(self):
        """A truth drawn from the prior, its source somewhere in front of the arm and of some strength."""
        root = np.linalg.cholesky(self.cov)
        theta = self.mean + root @ self.rng.standard_normal(len(self.mean))
        theta[:3] = self.rng.uniform([0.22, -0.2, 0.1], [0.42, 0.2, 0.28])
        theta[3] = np.log(20.0) + 0.3 * self.rng.standard_normal()
        return theta

    def path(self, poses=8, stay_s=1.0, off=None):
        """Times (k,) s and joints (k, n) of random poses, each with a second to get there; none within 4 cm of `off` (3,) m."""
        t = np.arange(0.0, poses * (1.0 + stay_s), STEP_S)
        goals = [self.arm.home, *(self._pose(off) for _ in range(poses))]
        leg = np.minimum((t / (1.0 + stay_s)).astype(int), poses - 1)
        share = np.array([smooth(x) for x in t - leg * (1.0 + stay_s)])
        q = np.array([goals[i] + s * (goals[i + 1] - goals[i]) for i, s in zip(leg, share, strict=True)])
        return t, q

    def _pose(self, off):
        while True:
            q = self.arm.random_pose(self.rng)
            if off is None or np.linalg.norm(self.arm.nose(q) - off) > 0.04:
                return q

    def problem(self, theta, poses=8, stay_s=1.0, quiet=False, noise=NOISE):
        """The fit of a trace that theta made: MAP with the lab's prior. `quiet` leaves fluctuation and noise out."""
        t, q = self.path(poses, stay_s, theta[:3])
        lay = self.layout
        at = np.arange(0, len(t), EVERY)
        q_seen = q + theta[lay.offset] + 0.5 * t[:, None] ** 2 * theta[lay.drift]
        element = np.arange(len(at)) % self.elements
        ppm = np.full(len(at), 1.0)
        made = Problem(
            Sniffs(t, q_seen, at, t[at], element, ppm, np.full(len(at), SIGMA_PPM)),
            self.arm, self.law, self.elements, RISE_S, FALL_S, self.mean, self.cov,
        )  # fmt: skip
        start = made.predict(theta).along.field.mean_ppm[0]  # the lag has settled where the path begins
        ppm[0] = start * np.exp(theta[lay.gain][0]) + theta[lay.baseline][0]
        expected = made.predict(theta)
        ppm = expected.ppm + theta[lay.baseline][element]
        if not quiet:
            ppm = ppm + drawn(expected.along, noise, self.rng)
        return replace(made, sniffs=replace(made.sniffs, ppm=ppm))


def drawn(along, noise, rng):
    """What fluctuation and white noise add to the readings (m,) ppm: the process of `oio.fluctuation`, step by step."""
    keep, swing = np.exp(-along.dt_s * noise.rate(along.field)), along.field.mean_ppm * noise.height(along.field)
    lagged, m, path = 0.0, noise.gamma * rng.standard_normal(), []
    for k, phi, s in zip(keep, along.phi, swing, strict=True):
        lagged = phi * lagged + (1.0 - phi) * s * m
        m = k * m + noise.gamma * np.sqrt(1.0 - k * k) * rng.standard_normal()
        path.append(lagged)
    white = np.sqrt(noise.scale * along.variance_ppm2) * rng.standard_normal(len(along.at))
    return along.gain * np.array(path)[along.at] + white


@pytest.fixture(scope="session")
def lab(built):
    """lab(dof, elements, seed)."""
    return lambda dof=3, elements=1, seed=0: Lab(built, dof, elements, seed)


@pytest.fixture(scope="session")
def draw():
    return drawn
