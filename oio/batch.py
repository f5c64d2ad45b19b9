"""Maximum a posteriori fit of source, law, lag, gains, offsets and encoder drift to one trace of readings, through the sensor's lag.

theta = (s (3) m | l | n | k (3) 1/m | o (dof) rad | a (dof) rad/s^2 | ln g (E) | ln tau factor | b (E) ppm)

Reading i of element e at time t:  z_i = g_e f(t_i) + b_e + noise,  f the lagged mean concentration at the nose p(q - o - a t^2 / 2).
Gas fluctuates in proportion to itself, more where the plume comes seldom, and slowly:  var z_i = R_i + gamma^2 I (g f)^2  with
I = exp(|k| r - k.d) (how much rarer the plume is here than on its axis: a plume that is there a fraction p of the time has variance
mean^2 (1/p - 1)), correlated over T r / r_ref (an eddy takes longer to pass where the plume is wide). Neighbours are whitened (Cochrane &
Orcutt 1949) with weights from the last fit. Known things enter as tight priors, so that one fit serves the beacon (s known) and the
search (s unknown). Gauss-Newton/Levenberg-Marquardt: scipy.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from oio.arm import Arm
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
class Fluctuation:
    """The gas as read: var = scale * sigma_reading^2 + gamma^2 I mean^2, the second part correlated over t_s * r / r_ref."""

    scale: float
    gamma: float
    t_s: float


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Answer of `solve`: mean and cov of theta, chi2 with prior, and the lagged mean concentration at the end of the trace."""

    layout: Layout
    mean: Array
    cov: Array
    chi2: float
    lagged_ppm: float
    fluctuation: Fluctuation


@dataclass(frozen=True, slots=True, eq=False)
class Expected:
    """What a theta expects: readings without offsets (m,) ppm, their derivatives (m, P), lagged concentration on the path (k,) ppm,
    and at the readings the distance r (m,) m and the rarity I (m,)."""

    ppm: Array
    rows: Array
    lagged: Array
    r_m: Array
    rarity: Array


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
        f, df, df_tau = lagged(c, dc, dt, self.rise_s * factor, self.fall_s * factor, self._start(theta))
        gain = np.exp(theta[lay.gain])[sn.element]
        h = gain * f[sn.at]
        rows = np.zeros((len(sn.at), lay.size))
        rows[:, : 8 + 2 * lay.dof] = gain[:, None] * df[sn.at]
        rows[np.arange(len(sn.at)), lay.gain.start + sn.element] = h
        rows[:, lay.tau] = gain * df_tau[sn.at]
        rows[np.arange(len(sn.at)), lay.baseline.start + sn.element] = 1.0
        return Expected(h, rows, f, r[sn.at], rarity[sn.at])

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
        weigh = Weights(problem, theta, noise)
        u = least_squares(
            lambda u, w=weigh: np.concatenate([w.white(_residual(problem, problem.mean + root @ u)), u]),
            np.linalg.solve(root, theta - problem.mean),
            jac=lambda u, w=weigh: np.concatenate([-w.white(problem.predict(problem.mean + root @ u).rows) @ root, np.eye(len(u))]),
            method="lm", max_nfev=30, xtol=1e-6, ftol=1e-6,
        )  # fmt: skip
        theta = problem.mean + root @ u.x
    weigh, expected = Weights(problem, theta, noise), problem.predict(theta)
    rows = np.concatenate([weigh.white(expected.rows) @ root, np.eye(len(theta))])
    cov = root @ np.linalg.inv(rows.T @ rows) @ root.T
    u_end = np.linalg.solve(root, theta - problem.mean)
    chi2 = weigh.minus_2_log_likelihood(problem.residual(theta, expected.ppm)) + float(u_end @ u_end)
    return Fit(problem.layout, theta, 0.5 * (cov + cov.T), chi2, float(expected.lagged[-1]), noise)


def _residual(problem: Problem, theta: Array) -> Array:
    return problem.residual(theta, problem.predict(theta).ppm)


class Weights:
    """Whitening of residuals: standard deviations and neighbour correlations, frozen at one theta."""

    def __init__(self, problem: Problem, theta: Array, noise: Fluctuation) -> None:
        expected, sn = problem.predict(theta), problem.sniffs
        white = noise.scale * sn.sigma_ppm**2
        gas = (noise.gamma * expected.ppm) ** 2 * expected.rarity
        self.sigma = np.sqrt(white + gas)
        share, t = gas / (white + gas), noise.t_s * expected.r_m / problem.law.r_ref_m
        passing = np.exp(-np.diff(sn.reading_t_s) / np.sqrt(t[1:] * t[:-1]))
        self.rho = np.sqrt(share[1:] * share[:-1]) * passing
        self.left = np.sqrt(1.0 - self.rho**2)

    def white(self, rows: Array) -> Array:
        """Residuals (m,) or rows (m, P) to unit variance and no neighbour correlation."""
        scaled = rows / (self.sigma if rows.ndim == 1 else self.sigma[:, None])
        rho, left = (self.rho, self.left) if rows.ndim == 1 else (self.rho[:, None], self.left[:, None])
        return np.concatenate([scaled[:1], (scaled[1:] - rho * scaled[:-1]) / left])

    @property
    def independent(self) -> float:
        """How many independent readings they are worth: sum of (1 - rho) / (1 + rho) over neighbours."""
        return 1.0 + float(np.sum((1.0 - self.rho) / (1.0 + self.rho)))

    def minus_2_log_likelihood(self, residual: Array) -> float:
        """-2 ln L of residuals (m,), up to a constant."""
        white = self.white(residual)
        return float(white @ white + 2.0 * np.sum(np.log(self.sigma)) + 2.0 * np.sum(np.log(self.left)))


GAMMAS = np.geomspace(0.02, 1.5, 14)
TIMES_S = np.geomspace(0.1, 20.0, 12)


def fluctuation(problem: Problem, theta: Array, scale: float) -> Fluctuation:
    """How the gas fluctuates about a fit: gamma and T of greatest likelihood of its residuals, on a grid; `scale` is the baseline's."""
    residual = _residual(problem, theta)
    choices = [Fluctuation(scale, float(g), float(t)) for g in GAMMAS for t in TIMES_S]
    return min(choices, key=lambda noise: Weights(problem, theta, noise).minus_2_log_likelihood(residual))
