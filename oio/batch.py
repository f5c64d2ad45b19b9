"""Maximum a posteriori fit of source, law, lag, gains, offsets and encoder drift to one trace of readings, through the sensor's lag.

theta = (s (3) m | l | n | k (3) 1/m | o (dof) rad | a (dof) rad/s^2 | ln g (E) | ln tau factor | b (E) ppm)

Reading i of element e at time t:  z_i = g_e f(t_i) + b_e + noise,  f the lagged mean concentration at the nose p(q - o - a t^2 / 2);
the noise is that of `oio.fluctuation`. Known things enter as tight priors, so that one fit serves the beacon (s known) and the search
(s unknown). Gauss-Newton/Levenberg-Marquardt by scipy, with weights from the last pass.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from oio.arm import Arm
from oio.fluctuation import Along, Fluctuation, whiten
from oio.ranging import RangeLaw, concentration, lagged
from oio.records import Array
from oio.trace import Sniffs

PASSES = 3  # weights and answer in turn


@dataclass(frozen=True, slots=True)
class Layout:
    """Where each block of theta lies."""

    dof: int
    elements: int

    @property
    def size(self) -> int:
        """Length of theta."""
        return 8 + 2 * self.dof + 2 * self.elements + 1

    source, strength, exponent, wind = slice(0, 3), 3, 4, slice(5, 8)

    @property
    def offset(self) -> slice:
        """Joint offsets at t = 0 [rad]."""
        return slice(8, 8 + self.dof)

    @property
    def drift(self) -> slice:
        """Accelerations of the encoders [rad/s^2]."""
        return slice(8 + self.dof, 8 + 2 * self.dof)

    @property
    def gain(self) -> slice:
        """ln(gain) of the elements."""
        return slice(8 + 2 * self.dof, 8 + 2 * self.dof + self.elements)

    @property
    def tau(self) -> int:
        """ln(lag / nominal lag)."""
        return 8 + 2 * self.dof + self.elements

    @property
    def baseline(self) -> slice:
        """Offsets of the elements [ppm]."""
        return slice(self.size - self.elements, self.size)


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Answer of `solve`: mean and cov of theta, -2 ln posterior up to a constant, lagged mean concentration at the end of the trace."""

    layout: Layout
    mean: Array
    cov: Array
    chi2: float
    lagged_ppm: float
    fluctuation: Fluctuation
    readings: int


@dataclass(frozen=True, slots=True, eq=False)
class Expected:
    """What a theta expects: readings without offsets (m,) ppm, their derivatives (m, P), the lagged concentration at the end of the path
    [ppm], and the mean field along the path."""

    ppm: Array
    rows: Array
    lagged_ppm: float
    along: Along


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """One trace with the arm that carried the nose, the law, the nominal lag [s] and what is known before (mean, cov of theta)."""

    sniffs: Sniffs
    arm: Arm
    law: RangeLaw
    elements: int
    rise_s: float
    fall_s: float
    mean: Array
    cov: Array

    @property
    def layout(self) -> Layout:
        """Of theta."""
        return Layout(self.arm.dof, self.elements)

    def predict(self, theta: Array) -> Expected:
        """Forward model and its derivatives at theta (P,)."""
        sn, lay = self.sniffs, self.layout
        t2 = 0.5 * sn.t_s**2
        p, jac = self.arm.nose_jacobian(sn.q - theta[lay.offset] - t2[:, None] * theta[lay.drift])
        c, grad, r, rarity = concentration(p, theta[:8], self.law.r_ref_m, self.law.radius_m)
        by_q = np.einsum("ij,ijk->ik", grad[:, :3], jac)  # d ln c / d o = grad_s . J, because p falls as o grows
        dc = c[:, None] * np.concatenate([grad, by_q, t2[:, None] * by_q], axis=1)
        factor = np.exp(theta[lay.tau])
        dt = np.diff(sn.t_s, prepend=sn.t_s[0])
        f, df, df_tau, phi = lagged(c, dc, dt, self.rise_s * factor, self.fall_s * factor, self._start(theta))
        gain = np.exp(theta[lay.gain])[sn.element]
        h = gain * f[sn.at]
        rows = np.zeros((len(sn.at), lay.size))
        rows[:, : 8 + 2 * lay.dof] = gain[:, None] * df[sn.at]
        rows[np.arange(len(sn.at)), lay.gain.start + sn.element] = h
        rows[:, lay.tau] = gain * df_tau[sn.at]
        rows[np.arange(len(sn.at)), lay.baseline.start + sn.element] = 1.0
        along = Along(dt, phi, c * np.sqrt(rarity), r / self.law.r_ref_m, sn.at, gain, sn.sigma_ppm**2)
        return Expected(h, rows, float(f[-1]), along)

    def _start(self, theta: Array) -> float:
        lay, e = self.layout, int(self.sniffs.element[0])
        return max(float(self.sniffs.ppm[0] - theta[lay.baseline][e]) / float(np.exp(theta[lay.gain][e])), 0.0)

    def residual(self, theta: Array, h: Array) -> Array:
        """Readings minus expectation (m,) ppm."""
        return self.sniffs.ppm - h - theta[self.layout.baseline][self.sniffs.element]


def solve(problem: Problem, start: Array, noise: Fluctuation) -> Fit:
    """MAP from one start theta (P,); weights are refreshed PASSES times."""
    root = np.linalg.cholesky(problem.cov)
    theta = start
    for _ in range(PASSES):
        along = problem.predict(theta).along
        u = least_squares(
            lambda u, w=along: np.concatenate([_white(problem, problem.mean + root @ u, w, noise), u]),
            np.linalg.solve(root, theta - problem.mean),
            jac=lambda u, w=along: np.concatenate([-_white_rows(problem, problem.mean + root @ u, w, noise) @ root, np.eye(len(u))]),
            method="lm", max_nfev=30, xtol=1e-6, ftol=1e-6,
        )  # fmt: skip
        theta = problem.mean + root @ u.x
    return _finished(problem, theta, root, noise)


def _finished(problem: Problem, theta: Array, root: Array, noise: Fluctuation) -> Fit:
    expected = problem.predict(theta)
    rows = np.concatenate([whiten(expected.rows, expected.along, noise).rows @ root, np.eye(len(theta))])
    cov = root @ np.linalg.inv(rows.T @ rows) @ root.T
    u = np.linalg.solve(root, theta - problem.mean)
    fit = whiten(problem.residual(theta, expected.ppm)[:, None], expected.along, noise).minus_2_log_likelihood
    return Fit(problem.layout, theta, 0.5 * (cov + cov.T), fit + float(u @ u), expected.lagged_ppm, noise, len(expected.ppm))


def _white(problem: Problem, theta: Array, along: Along, noise: Fluctuation) -> Array:
    return whiten(problem.residual(theta, problem.predict(theta).ppm)[:, None], along, noise).rows[:, 0]


def _white_rows(problem: Problem, theta: Array, along: Along, noise: Fluctuation) -> Array:
    return whiten(problem.predict(theta).rows, along, noise).rows
