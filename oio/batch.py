"""Maximum a posteriori fit of source, law, lag, gains, offsets and encoder drift to one trace of readings, through the sensor's lag.

theta = (s (3) m | l | n | k (3) 1/m | u 1/m | o (dof) rad | a (dof) rad/s^2 | ln g (E) | ln tau factor | b (E) ppm)

Reading i of element e at time t:  z_i = g_e f(t_i) + b_e + noise,  f the lagged mean concentration at the nose p(q - o - a t^2 / 2);
the noise is that of `oio.fluctuation`. Known things enter as tight priors, so that one fit serves the beacon (s known) and the search
(s unknown)."""

from dataclasses import dataclass

import numpy as np

from oio.arm import Arm
from oio.fluctuation import Along, Fluctuation, whiten
from oio.ranging import LAW, RangeLaw, concentration, lagged
from oio.records import Array
from oio.trace import Sniffs

STEPS = 20  # at most
SETTLED = 8  # after so many steps the whitening is frozen, so that answer and weights cannot chase each other
STEP2 = 2e-3  # squared posterior standard deviations
FARTHEST = 2.0  # prior standard deviations that one step may go in one parameter


@dataclass(frozen=True, slots=True)
class Layout:
    """Where each block of theta lies."""

    dof: int
    elements: int

    @property
    def size(self) -> int:
        """Length of theta."""
        return LAW + 2 * self.dof + 2 * self.elements + 1

    law, source, strength, exponent, wind, thinning = slice(0, LAW), slice(0, 3), 3, 4, slice(5, 8), 8

    @property
    def offset(self) -> slice:
        """Joint offsets at t = 0 [rad]."""
        return slice(LAW, LAW + self.dof)

    @property
    def drift(self) -> slice:
        """Accelerations of the encoders [rad/s^2]."""
        return slice(LAW + self.dof, LAW + 2 * self.dof)

    @property
    def gain(self) -> slice:
        """ln(gain) of the elements."""
        return slice(LAW + 2 * self.dof, LAW + 2 * self.dof + self.elements)

    @property
    def tau(self) -> int:
        """ln(lag / nominal lag)."""
        return LAW + 2 * self.dof + self.elements

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
        c, grad, r, rarity = concentration(p, theta[:LAW], self.law.r_ref_m, self.law.radius_m)
        by_q = np.einsum("ij,ijk->ik", grad[:, :3], jac)  # d ln c / d o = grad_s . J, because p falls as o grows
        dc = c[:, None] * np.concatenate([grad, by_q, t2[:, None] * by_q], axis=1)
        factor = np.exp(theta[lay.tau])
        dt = np.diff(sn.t_s, prepend=sn.t_s[0])
        f, df, df_tau, tau = lagged(c, dc, dt, self.rise_s * factor, self.fall_s * factor, self._start(theta))
        gain = np.exp(theta[lay.gain])[sn.element]
        h = gain * f[sn.at]
        rows = np.zeros((len(sn.at), lay.size))
        rows[:, : LAW + 2 * lay.dof] = gain[:, None] * df[sn.at]
        rows[np.arange(len(sn.at)), lay.gain.start + sn.element] = h
        rows[:, lay.tau] = gain * df_tau[sn.at]
        rows[np.arange(len(sn.at)), lay.baseline.start + sn.element] = 1.0
        speed = np.linalg.norm(np.diff(p, axis=0, prepend=p[:1]), axis=1) / np.maximum(dt, 1e-9)
        field = self.law.field(c, rarity, r, speed, float(theta[lay.exponent]))
        along = Along(field, dt, tau, sn.at, gain, sn.sigma_ppm**2)
        return Expected(h, rows, float(f[-1]), along)

    def _start(self, theta: Array) -> float:
        lay, e = self.layout, int(self.sniffs.element[0])
        return max(float(self.sniffs.ppm[0] - theta[lay.baseline][e]) / float(np.exp(theta[lay.gain][e])), 0.0)

    def residual(self, theta: Array, h: Array) -> Array:
        """Readings minus expectation (m,) ppm."""
        return self.sniffs.ppm - h - theta[self.layout.baseline][self.sniffs.element]


def solve(problem: Problem, start: Array, noise: Fluctuation) -> Fit:
    """MAP from one start theta (P,) by Levenberg-Marquardt in units of the prior, theta = mean + L u with L L' = prior.

    The whitening follows the answer from step to step; a step is judged with the whitening at its beginning. It ends when the Newton
    decrement, the squared step in posterior standard deviations, is below STEP2, or after STEPS steps.
    """
    root = np.asarray(np.linalg.cholesky(problem.cov), dtype=np.float64)
    u: Array = np.asarray(np.linalg.solve(root, start - problem.mean), dtype=np.float64)
    damping = 1e-3
    along = problem.predict(start).along
    for i in range(STEPS):
        theta = problem.mean + root @ u
        expected = problem.predict(theta)
        along = expected.along if i < SETTLED else along
        both = np.column_stack([problem.residual(theta, expected.ppm), expected.rows])
        white = whiten(both, along, noise).rows
        rows, before = white[:, 1:] @ root, float(white[:, 0] @ white[:, 0] + u @ u)
        hessian, slope = rows.T @ rows + np.eye(len(u)), rows.T @ white[:, 0] - u
        step, damping = _step(problem, (u, root, along, noise), (hessian, slope, before), damping)
        u = u + step
        if step @ hessian @ step < STEP2:
            break
    return _finished(problem, problem.mean + root @ u, root, noise)


def _step(
    problem: Problem, at: tuple[Array, Array, Along, Fluctuation], quadratic: tuple[Array, Array, float], damping: float
) -> tuple[Array, float]:
    """A step that lowers the cost, and the damping to begin the next one with; zero if none does."""
    (u, root, along, noise), (hessian, slope, before) = at, quadratic
    while damping < 1e8:
        step = np.linalg.solve(hessian + damping * np.diag(np.diag(hessian)), slope)
        step = step * min(1.0, FARTHEST / max(float(np.max(np.abs(step))), 1e-12))
        theta = problem.mean + root @ (u + step)
        residual = whiten(problem.residual(theta, problem.predict(theta).ppm)[:, None], along, noise).rows[:, 0]
        after = float(residual @ residual + (u + step) @ (u + step))
        if after <= before:
            return np.asarray(step), damping * 0.2
        damping *= 8.0
    return np.zeros_like(u), damping


def _finished(problem: Problem, theta: Array, root: Array, noise: Fluctuation) -> Fit:
    expected = problem.predict(theta)
    rows = whiten(expected.rows, expected.along, noise).rows @ root
    cov = root @ np.linalg.inv(rows.T @ rows + np.eye(len(theta))) @ root.T
    u = np.linalg.solve(root, theta - problem.mean)
    fit = whiten(problem.residual(theta, expected.ppm)[:, None], expected.along, noise).minus_2_log_likelihood
    return Fit(problem.layout, theta, 0.5 * (cov + cov.T), fit + float(u @ u), expected.lagged_ppm, noise, len(expected.ppm))
