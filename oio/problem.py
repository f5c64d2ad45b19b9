"""The forward model of a trace of readings, with its derivatives: what the batch fit fits.

theta = (s (3) m | l | n | k (3) 1/m | u 1/m | o (dof) rad | a (dof) rad/s^2 | ln g (E) | ln tau factor | b (E) ppm)

Reading i of element e at time t:  z_i = g_e f(t_i) + b_e + noise,  f the lagged mean concentration at the nose p(q - o - a t^2 / 2);
the noise is that of `oio.fluctuation`.
"""

from dataclasses import dataclass

import numpy as np

from oio import censored
from oio.arm import Arm
from oio.fluctuation import Along
from oio.ranging import LAW, RangeLaw, concentration, lagged
from oio.records import Array
from oio.trace import Sniffs


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
        t2, dt = 0.5 * sn.t_s**2, self._steps()
        p, jac = self.arm.nose_jacobian(self._joints(theta))
        c, grad, r, rarity = concentration(p, theta[:LAW], self.law.r_ref_m, self.law.radius_m)
        by_q = np.einsum("ij,ijk->ik", grad[:, :3], jac)  # d ln c / d o = grad_s . J, because p falls as o grows
        dc = c[:, None] * np.concatenate([grad, by_q, t2[:, None] * by_q], axis=1)
        factor, start = np.exp(theta[lay.tau]), self._start(theta)
        f, df, df_tau, tau = lagged(c, dc, dt, self.rise_s * factor, self.fall_s * factor, start)
        gain = np.exp(theta[lay.gain])[sn.element]
        speed = np.linalg.norm(np.diff(p, axis=0, prepend=p[:1]), axis=1) / np.maximum(dt, 1e-9)
        field = self.law.field(c, rarity, r, speed, float(theta[lay.exponent]))
        rows = self._rows(gain, f[sn.at], df[sn.at], df_tau[sn.at])
        if start > 0.0:
            self._add_start(rows, gain * np.cumprod(np.exp(-dt / tau))[sn.at], start, float(gain[0]))
        h = gain * f[sn.at]
        return Expected(h, rows, float(f[-1]), Along(field, dt, tau, sn.at, gain, self.variance(theta, h)))

    def nose(self, theta: Array) -> Array:
        """Where the nose was along the path (k, 3) m."""
        return self.arm.nose(self._joints(theta))

    def expect(self, theta: Array, nose_m: Array | None = None) -> Array:
        """The expected readings alone, without offsets (m,) ppm: half the work of `predict`, a third if `nose(theta)` is given."""
        sn, lay, factor = self.sniffs, self.layout, np.exp(theta[self.layout.tau])
        p = self.nose(theta) if nose_m is None else nose_m
        c, _, _, _ = concentration(p, theta[:LAW], self.law.r_ref_m, self.law.radius_m)
        none = np.empty((len(c), 0))
        f, _, _, _ = lagged(c, none, self._steps(), self.rise_s * factor, self.fall_s * factor, self._start(theta))
        return np.asarray(np.exp(theta[lay.gain])[sn.element] * f[sn.at])

    def _joints(self, theta: Array) -> Array:
        lay = self.layout
        return self.sniffs.q - theta[lay.offset] - 0.5 * self.sniffs.t_s[:, None] ** 2 * theta[lay.drift]

    def _steps(self) -> Array:
        return np.diff(self.sniffs.t_s, prepend=self.sniffs.t_s[0])

    def _start(self, theta: Array) -> float:
        lay, e = self.layout, int(self.sniffs.element[0])
        return max(float(self.sniffs.ppm[0] - theta[lay.baseline][e]) / float(np.exp(theta[lay.gain][e])), 0.0)

    def _rows(self, gain: Array, f: Array, df: Array, df_tau: Array) -> Array:
        sn, lay = self.sniffs, self.layout
        each, rows = np.arange(len(sn.at)), np.zeros((len(sn.at), lay.size))
        rows[:, : LAW + 2 * lay.dof] = gain[:, None] * df
        rows[each, lay.gain.start + sn.element] = gain * f
        rows[:, lay.tau] = gain * df_tau
        rows[each, lay.baseline.start + sn.element] = 1.0
        return rows

    def _add_start(self, rows: Array, left: Array, start: float, gain: float) -> None:
        """The lag begins at (z_0 - b) / g of the first reading's element; `left` (m,) is how much of that is left in each reading."""
        lay, e = self.layout, int(self.sniffs.element[0])
        rows[:, lay.baseline.start + e] -= left / gain
        rows[:, lay.gain.start + e] -= left * start

    def residual(self, theta: Array, h: Array) -> Array:
        """Readings minus expectation (m,) ppm; of a censored one what `oio.censored` makes of it."""
        sn = self.sniffs
        return censored.residual(self._miss(theta, h), sn.sigma_ppm, sn.censored)

    def variance(self, theta: Array, h: Array) -> Array:
        """White variance of the readings (m,) ppm^2; what a censored one tells hangs on what is expected."""
        return censored.variance(self._miss(theta, h), self.sniffs.sigma_ppm, self.sniffs.censored)

    def _miss(self, theta: Array, h: Array) -> Array:
        return np.asarray(self.sniffs.ppm - h - theta[self.layout.baseline][self.sniffs.element])
