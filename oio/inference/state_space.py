"""State-space model of olfactory inertial odometry: transition with process noise, and measurement model.

The state x is that of `oio.inference.state_vector`. The nose is at p(q - o). f follows c(p) (1 + h m) with the sensor's lag, m is an
Ornstein-Uhlenbeck process of variance gamma^2 and correlation time r / (r_ref / T + v). A reading of element e is g_e f + b_e + white
noise. Elements at two places (P = 2) have an f and an m each, the latter correlated by exp(-d / r), d the distance of the places.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from oio.core.records import Array, Belief, GasReading, JointState
from oio.gas.fluctuation import Fluctuation, lagged_ou_cross, lagged_ou_steps
from oio.gas.range_law import EXPONENT, LAW, SOURCE, WIND, RangeLaw, concentration
from oio.gas.source_shape import MOST, POINT_SOURCE, SourceShape, against_nose, field_of_shape
from oio.inference.map_fit import Fit
from oio.inference.process_noise import ProcessNoise
from oio.inference.state_vector import StateVector
from oio.inference.step_constants import GasConstants, StepConstants
from oio.inference.uncertainty import Noise
from oio.kinematics.arm import Arm


@dataclass(frozen=True)
class StateSpace(StateVector):
    """State-space model of the filter: arm, range law, lag, gains and noise; immutable."""

    arm: Arm
    law: RangeLaw
    process_noise: ProcessNoise
    rise_s: float
    fall_s: float
    gain: tuple[float, ...]
    fluctuation: Fluctuation
    sigma_ppm: float  # of one reading in clean air
    noise: Noise
    shape: SourceShape = POINT_SOURCE  # of the source, as a map found it

    def after(self, fit: Fit) -> "StateSpace":
        """Return the model for the world that a fit assumes: gains and noise, the shape of its source, and what may go on changing."""
        shape, density, extension = POINT_SOURCE, fit.extension.densities, fit.extension
        if extension.source:
            shape = SourceShape.of(extension.source, fit.mean[fit.layout.base + np.array(extension.shape)])
        walks = replace(
            self.process_noise,
            strength_sqrt_s=max(self.process_noise.strength_sqrt_s, density.strength if extension.strength else 0.0),
            wind_per_m_sqrt_s=max(self.process_noise.wind_per_m_sqrt_s, density.wind if extension.wind else 0.0),
        )
        gain = tuple(float(g) for g in np.exp(fit.mean[fit.layout.gain]))
        return replace(self, gain=gain, fluctuation=fit.fluctuation, law=fit.law, process_noise=walks, shape=shape)

    def nose(self, belief: Belief, joints: JointState) -> tuple[Array, Array]:
        """Estimated nose position (3,) [m] and its covariance (3, 3) [m^2]."""
        o = self.at["o"]
        p, jac = self.arm.nose_jacobian(joints.q - belief.mean[o])
        return p, jac @ belief.cov[o, o] @ jac.T

    def transition(self, x: Array, dt_s: float, joints: JointState) -> tuple[Array, Array, Array]:
        """State transition: x (N,) after dt_s with the encoders at `joints`, its Jacobian F (N, N), and process noise Q (N, N).

        F takes amplitude and rate of the gas fluctuation as constant; their dependence on the source is neglected (exact at m = 0).
        """
        at, n, fl = self.at, self.arm.dof, self.fluctuation
        o, v, a = np.arange(n), np.arange(n, 2 * n), np.arange(2 * n, 3 * n)
        new, jacobian = x.copy(), np.eye(self.size)
        new[at["o"]] += dt_s * x[at["v"]] + 0.5 * dt_s**2 * x[at["a"]]
        new[at["v"]] += dt_s * x[at["a"]]
        jacobian[o, v], jacobian[o, a], jacobian[v, a] = dt_s, 0.5 * dt_s**2, dt_s
        q = np.diag(self.process_noise_diagonal(dt_s))
        if self.process_noise.drift_deg_s2_sqrt_s > 0.0:
            q[: 3 * n, : 3 * n] += np.kron(self._drift_process_noise(dt_s), np.eye(n))
        rows = (joints.q - 0.5 * dt_s * joints.dq - new[at["o"]])[None]  # midpoint: concentration is constant over a step
        gas = [self._gas_step(x, new, jacobian, q, e, p[0], jac[0], dt_s, joints) for e, (p, jac) in self._element_poses(rows)]
        if self.places == 2:
            self._add_cross(q, gas, fl.gamma**2)
        return new, jacobian, q

    def _element_poses(self, q: Array) -> Iterable[tuple[int, tuple[Array, Array]]]:
        return enumerate(zip(*self.arm.element_jacobians(q, self.elements), strict=True))

    def _gas_step(
        self, x: Array, new: Array, jacobian: Array, q: Array, e: int, p: Array, jac: Array, dt_s: float, joints: JointState
    ) -> tuple[Array, float, float, float, float]:
        """Fill f and m of place e at p (3,) with Jacobian (3, n); return its lag and fluctuation terms (6,), tau, correlation time,
        amplitude and distance."""
        at, s, fl = self.at, self.at["s"].start, self.fluctuation
        i, m = at["f"].start + e, at["m"].start + e
        c, grad, r, rarity = concentration(p[None, :], x[s : s + LAW], self.law.r_ref_m, self.law.radius_m)
        by_nose = grad[0, SOURCE]
        if self.shape.kind:
            scale, first, by_shape = (self.law.r_ref_m, self.law.radius_m), (c[0], r[0], rarity[0]), np.empty(MOST)
            c[0], r[0], rarity[0] = field_of_shape(tuple(p), x[s : s + LAW], self.shape, scale, first, grad[0], by_shape)
            by_nose = np.array([against_nose(self.shape.kind, grad[0], by_shape, a) for a in range(3)])
        field = self.law.field(c, rarity, r, self._speed(jac, joints), float(x[s + EXPONENT]), grad[:, WIND])
        amplitude = c * fl.height(field)
        tau = np.array([self.rise_s if c[0] + amplitude[0] * x[m] > x[i] else self.fall_s])
        step = lagged_ou_steps(np.array([dt_s]), tau, 1.0 / fl.rate(field), amplitude, fl.gamma**2)[0]
        phi, coupling, keep = step[:3]
        new[i] = phi * x[i] + (1.0 - phi) * c[0] + coupling * x[m]
        new[m] = keep * x[m]
        f_by_ln_c = (1.0 - phi) * c[0] + coupling * x[m]  # both parts are proportional to c
        by_o = f_by_ln_c * by_nose @ jac
        jacobian[i, s : s + LAW] = f_by_ln_c * grad[0]
        jacobian[i, at["o"]], jacobian[i, at["v"]], jacobian[i, at["a"]] = by_o, dt_s * by_o, 0.5 * dt_s**2 * by_o
        jacobian[i, i], jacobian[i, m], jacobian[m, m] = phi, coupling, keep
        q[i, i], q[i, m], q[m, i], q[m, m] = step[3], step[4], step[4], step[5]
        return step, float(tau[0]), float(1.0 / fl.rate(field)[0]), float(amplitude[0]), float(r[0])

    def _add_cross(self, q: Array, gas: list[tuple[Array, float, float, float, float]], variance: float) -> None:
        """Covariance of the two places' noise in Q: their fluctuations are correlated."""
        (step, *one), (other, *two) = gas
        (tau, t, swing, r), out, f, m = np.stack([one, two], axis=1), np.empty(4), self.at["f"].start, self.at["m"].start
        rho = float(np.exp(-2.0 * self.arm.spacing_m / np.sum(r)))
        lagged_ou_cross(step, other, tau, t, swing, variance, rho, out)
        for i, j, value in zip((f, f, m, m), (f + 1, m + 1, f + 1, m + 1), out, strict=True):
            q[i, j] = q[j, i] = value

    def _speed(self, jac: Array, joints: JointState) -> Array:
        """Speed of the nose (1,) [m/s]; a joint slower than one count per sample is at rest."""
        moving = np.abs(joints.dq) > self.process_noise.rest_speed_rad_s
        return np.array([np.linalg.norm(jac @ (joints.dq * moving))])

    def _drift_process_noise(self, dt_s: float) -> Array:
        """Q (3, 3) of offset, rate and acceleration of a joint whose acceleration is a random walk (Van Loan 1978, in closed form)."""
        t = dt_s
        shape = np.array([[t**5 / 20, t**4 / 8, t**3 / 6], [t**4 / 8, t**3 / 3, t**2 / 2], [t**3 / 6, t**2 / 2, t]])
        return np.asarray(np.radians(self.process_noise.drift_deg_s2_sqrt_s) ** 2 * shape)

    def process_noise_diagonal(self, dt_s: float) -> Array:
        """Diagonal of Q (N,) over dt_s for all independent random walks."""
        w, at = self.process_noise, self.at
        q = np.zeros(self.size)
        q[at["o"]] = np.radians(w.offset_deg_sqrt_s) ** 2 * dt_s
        q[at["s"]] = self.noise.source_q_m2 * (dt_s if self.noise.assembly == "gum" else 1.0)
        q[at["l"]] = w.strength_sqrt_s**2 * dt_s
        q[at["n"]] = w.exponent_sqrt_s**2 * dt_s
        q[at["k"]] = w.wind_per_m_sqrt_s**2 * dt_s
        q[at["b"]] = (w.baseline_sigmas_sqrt_s * self.sigma_ppm) ** 2 * dt_s
        return q

    @cached_property
    def constants(self) -> "StepConstants":
        """Constants of the model for `oio.estimators.propagation_kernel`."""
        law, fl, per_step = self.law, self.fluctuation, self.process_noise_diagonal(0.0)
        gas = GasConstants(
            law.r_ref_m, law.radius_m, self.rise_s, self.fall_s, fl.gamma, fl.t_s, law.nose_jitter_m, law.model_discrepancy,
            self.process_noise.rest_speed_rad_s, np.array([chain.offset for chain in self.arm.element_chains[: self.places]]),
            self.arm.spacing_m, fl.sway, fl.sway_s, self.shape,
        )  # fmt: skip
        drift = float(np.radians(self.process_noise.drift_deg_s2_sqrt_s)) ** 2
        return StepConstants(gas, np.array([per_step, self.process_noise_diagonal(1.0) - per_step]), drift)

    def measurement(self, x: Array, reading: GasReading) -> tuple[float, Array, float]:
        """Measurement model: predicted reading [ppm], Jacobian H (N,), and R [ppm^2], variance of a single reading or the assembly's."""
        e, i = reading.element, self.at["f"].start + self.place_of[reading.element]
        row = np.zeros(self.size)
        row[i], row[self.at["b"].start + e] = self.gain[e], 1.0
        single_ppm2 = self.fluctuation.scale * reading.sigma_ppm**2
        return float(row @ x), row, single_ppm2 if self.noise.r_ppm2 is None else self.noise.r_ppm2
