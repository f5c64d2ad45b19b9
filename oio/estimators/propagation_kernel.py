"""Compiled `StateSpace.transition` for many states at once, and covariance propagation that skips the zeros of F.

F = I but for the rows of o and v (dt, dt^2 / 2 beside them), f (`row`) and m (`keep`): F P F' costs a few rows, not two products.
`StateSpace.transition` is the readable reference; a test holds both to the same numbers.
"""

import numpy as np

from oio.core.compiled import compiled
from oio.core.records import Array
from oio.gas.fluctuation import lagged_ou_steps
from oio.gas.range_law import EXPONENT, LAW, concentration
from oio.gas.source_shape import MOST, against_nose, field_of_shape
from oio.inference.step_constants import GasConstants
from oio.kinematics.forward import SerialChain, nose_and_jacobian


@compiled
def propagate(x: Array, dt: float, q: Array, dq: Array, chain: SerialChain, gas: GasConstants) -> tuple[Array, Array, Array]:
    """Return f(x) (k, N), the rows of F for f (k, N), and the six terms of `lagged_ou_steps` (k, 6), for states x (k, N) and encoders
    at q (n,) rad moving at dq (n,) rad/s.

    The concentration of the step is that at the joint positions half a step earlier.
    """
    k, n, half = x.shape[0], len(q), 0.5 * dt * dt
    new = x.copy()
    for i in range(k):
        for j in range(n):
            new[i, j] += dt * x[i, n + j] + half * x[i, 2 * n + j]
            new[i, n + j] += dt * x[i, 2 * n + j]
    p, jac = nose_and_jacobian(q - 0.5 * dt * dq - new[:, :n], chain, True)
    c, grad, by_nose, steps = _field_at_nose(new, p, jac, dt, dq, gas)
    return new, _propagate_gas(new, c, (grad, by_nose), jac, steps, dt), steps


@compiled
def _field_at_nose(x: Array, p: Array, jac: Array, dt: float, dq: Array, gas: GasConstants) -> tuple[Array, Array, Array, Array]:
    """Mean concentration (k,) at noses p (k, 3), its relative gradients by the law (k, LAW) and by minus the nose (k, 3), and the lag and
    fluctuation terms (k, 6)."""
    r_ref, radius, rise, fall, gamma, t_ref, nose_jitter, discrepancy, rest_speed_rad_s, shape = gas
    k, n = x.shape[0], len(dq)
    c, grad, by_nose, by_shape = np.empty(k), np.empty((k, LAW)), np.empty((k, 3)), np.empty(MOST)
    tau, t, amplitude = np.empty(k), np.empty(k), np.empty(k)
    for i in range(k):
        theta = x[i, 3 * n : 3 * n + LAW]
        c_i, grad_i, r_i, rarity_i = concentration(p[i : i + 1], theta, r_ref, radius)
        c[i], grad[i], r, rarity = c_i[0], grad_i[0], r_i[0], rarity_i[0]
        if shape.kind:
            place, first = (p[i, 0], p[i, 1], p[i, 2]), (c[i], r, rarity)
            c[i], r, rarity = field_of_shape(place, theta, shape, (r_ref, radius), first, grad[i], by_shape)
        for a in range(3):
            by_nose[i, a] = against_nose(shape.kind, grad[i], by_shape, a)
        speed2 = 0.0
        for a in range(3):
            velocity = 0.0
            for j in range(n):
                velocity += jac[i, a, j] * dq[j] if abs(dq[j]) > rest_speed_rad_s else 0.0
            speed2 += velocity * velocity
        by_jitter, by_discrepancy = theta[EXPONENT] * nose_jitter / r, discrepancy * np.log(r / r_ref)
        amplitude[i] = c[i] * np.sqrt(rarity + (by_jitter * by_jitter + by_discrepancy * by_discrepancy) / (gamma * gamma))
        tau[i] = rise if c[i] + amplitude[i] * x[i, -1] > x[i, -2] else fall
        t[i] = r / (r_ref / t_ref + np.sqrt(speed2))
    return c, grad, by_nose, lagged_ou_steps(np.full(k, dt), tau, t, amplitude, gamma * gamma)


@compiled
def _propagate_gas(x: Array, c: Array, gradients: tuple[Array, Array], jac: Array, steps: Array, dt: float) -> Array:
    """Advance f and m of x (k, N) in place; returns the rows of F for f (k, N)."""
    k, n = x.shape[0], jac.shape[2]
    grad, by_nose = gradients
    rows = np.zeros(x.shape)
    for i in range(k):
        phi, coupling, keep = steps[i, 0], steps[i, 1], steps[i, 2]
        lag_input = (1.0 - phi) * c[i] + coupling * x[i, -1]
        for j in range(n):
            df_do = lag_input * (by_nose[i, 0] * jac[i, 0, j] + by_nose[i, 1] * jac[i, 1, j] + by_nose[i, 2] * jac[i, 2, j])
            rows[i, j], rows[i, n + j], rows[i, 2 * n + j] = df_do, dt * df_do, 0.5 * dt * dt * df_do
        rows[i, 3 * n : 3 * n + LAW] = lag_input * grad[i]
        rows[i, -2], rows[i, -1] = phi, coupling
        x[i, -2], x[i, -1] = phi * x[i, -2] + lag_input, keep * x[i, -1]
    return rows


@compiled
def apply_transition(a: Array, row: Array, keep: float, dt: float, n: int) -> Array:
    """Return the product F a (N, p)."""
    out, half = a.copy(), 0.5 * dt * dt
    out[-2] = 0.0
    for j in range(a.shape[0]):
        if row[j] != 0.0:
            for p in range(a.shape[1]):
                out[-2, p] += row[j] * a[j, p]
    for j in range(n):
        for p in range(a.shape[1]):
            out[j, p] += dt * a[n + j, p] + half * a[2 * n + j, p]
            out[n + j, p] += dt * a[2 * n + j, p]
    for p in range(a.shape[1]):
        out[-1, p] *= keep
    return out


@compiled
def apply_transition_transposed(a: Array, row: Array, keep: float, dt: float, n: int) -> Array:
    """Return the product F' a (N,)."""
    out = a.copy()
    out[-2], out[-1] = 0.0, keep * a[-1]
    for j in range(a.shape[0]):
        out[j] += row[j] * a[-2]
    for j in range(n):
        out[2 * n + j] += dt * a[n + j] + 0.5 * dt * dt * a[j]
        out[n + j] += dt * a[j]
    return out


@compiled
def propagate_covariance(cov: Array, row: Array, step: Array, dt: float, n: int, walk: Array, drift: float) -> Array:
    """Return F P F' + Q (N, N), symmetric to the bit."""
    half = apply_transition(cov, row, step[2], dt, n)
    out = apply_transition(half.T.copy(), row, step[2], dt, n)
    return add_process_noise(out, step, dt, n, walk, drift)


@compiled
def add_process_noise(cov: Array, step: Array, dt: float, n: int, walk: Array, drift: float) -> Array:
    """Return P + Q (N, N), symmetric to the bit; walk (2, N) is the random-walk variance per step and per second, drift the density of the
    encoders' acceleration noise [rad^2/s^4/s]."""
    size = cov.shape[0]
    out = np.empty((size, size))
    for i in range(size):
        for j in range(i + 1):
            out[i, j] = out[j, i] = 0.5 * (cov[i, j] + cov[j, i])
    for i in range(size):
        out[i, i] += walk[0, i] + dt * walk[1, i]
    t2, o, v, a = dt * dt, 0, n, 2 * n
    for j in range(n):
        for x, y, q in (
            (o, o, t2 * t2 * dt / 20), (o, v, t2 * t2 / 8), (o, a, t2 * dt / 6), (v, v, t2 * dt / 3), (v, a, t2 / 2), (a, a, dt),
        ):  # fmt: skip
            out[x + j, y + j] += drift * q
            out[y + j, x + j] = out[x + j, y + j]
    out[-2, -2] += step[3]
    out[-2, -1] += step[4]
    out[-1, -2] = out[-2, -1]
    out[-1, -1] += step[5]
    return out


@compiled
def predict(
    mean: Array, cov: Array, dt: float, q: Array, dq: Array, chain: SerialChain, gas: GasConstants, walk: Array, drift: float
) -> tuple[Array, Array]:
    """EKF time update: x = f(x) (N,), P = F P F' + Q (N, N)."""
    new, rows, steps = propagate(mean.copy().reshape(1, -1), dt, q, dq, chain, gas)
    return new[0], propagate_covariance(cov, rows[0], steps[0], dt, len(q), walk, drift)
