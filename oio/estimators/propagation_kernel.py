"""Compiled `StateSpace.transition` for many states at once, and covariance propagation that skips the zeros of F.

F = I but for the rows of o and v (dt, dt^2 / 2 beside them), f (`rows`) and m (`keep`): F P F' costs a few rows, not two products. With
the elements at P places there are P states f, then P states m. `StateSpace.transition` is the readable reference; a test holds both to
the same numbers.

`step` holds six numbers of `lagged_ou_step` for each place, then, for two, the four of `lagged_ou_cross`.
"""

import numpy as np

from oio.core.compiled import compiled
from oio.core.records import Array
from oio.gas.fluctuation import lagged_ou_cross, lagged_ou_steps, with_sway
from oio.gas.range_law import EXPONENT, KX, KY, KZ, LAW, SX, SY, SZ, concentration_at
from oio.gas.source_shape import MOST, against_nose, field_of_shape
from oio.inference.step_constants import GasConstants
from oio.kinematics.forward import SerialChain, nose_and_jacobian

OU, CROSS = 6, 4  # numbers of a place in a step, and of two places together


@compiled
def propagate(x: Array, dt: float, q: Array, dq: Array, chain: SerialChain, gas: GasConstants) -> tuple[Array, Array, Array]:
    """Return f(x) (k, N), the rows of F for f (k, P, N), and the terms of lag and fluctuation (k, 6 P, and 4 for two places), for states
    x (k, N) and encoders at q (n,) rad moving at dq (n,) rad/s.

    The concentration of the step is that at the joint positions half a step earlier.
    """
    k, n, half, count = x.shape[0], len(q), 0.5 * dt * dt, len(gas.places_m)
    new = x.copy()
    for i in range(k):
        for j in range(n):
            new[i, j] += dt * x[i, n + j] + half * x[i, 2 * n + j]
            new[i, n + j] += dt * x[i, 2 * n + j]
    rows, steps, numbers = np.empty((k, count, x.shape[1])), np.empty((k, OU * count + CROSS * (count - 1))), np.empty((count, 4, k))
    joints = q - 0.5 * dt * dq - new[:, :n]
    for e in range(count):
        at_place = SerialChain(chain.poses, chain.axes, chain.kinds, chain.locked, gas.places_m[e])
        p, jac = nose_and_jacobian(joints, at_place, bool(1))  # see `oio.kinematics.inverse`
        c, grad, by_nose, ou = _field_at_place(new, e, p, jac, dt, dq, gas, numbers[e])
        of_place = _propagate_gas(new, e, count, c, (grad, by_nose), jac, ou, dt)
        for i in range(k):  # numba compiles an array that is set to another for seconds: the words of an error go with it
            for j in range(x.shape[1]):
                rows[i, e, j] = of_place[i, j]
            for j in range(OU):
                steps[i, OU * e + j] = ou[i, j]
    if count == 2:
        for i in range(k):
            rho = np.exp(-2.0 * gas.spacing_m / (numbers[0, 3, i] + numbers[1, 3, i]))
            tau, t, swing = numbers[:, 0, i].copy(), numbers[:, 1, i].copy(), numbers[:, 2, i].copy()
            lagged_ou_cross(steps[i, :OU], steps[i, OU : 2 * OU], tau, t, swing, gas.gamma * gas.gamma, rho, steps[i, 2 * OU :])
    return new, rows, steps


@compiled
def _field_at_place(
    x: Array, e: int, p: Array, jac: Array, dt: float, dq: Array, gas: GasConstants, numbers: Array
) -> tuple[Array, Array, Array, Array]:
    """Mean concentration (k,) of place e at p (k, 3), its relative gradients by the law (k, LAW) and by minus the place (k, 3), and the
    lag and fluctuation terms (k, 6); tau, correlation time, amplitude and distance go to `numbers` (4, k)."""
    k, n, count = x.shape[0], len(dq), len(gas.places_m)
    lagged, relative = x.shape[1] - 2 * count + e, x.shape[1] - count + e
    c, grad, by_nose, by_shape = np.empty(k), np.empty((k, LAW)), np.empty((k, 3)), np.empty(MOST)
    tau, t, amplitude = np.empty(k), np.empty(k), np.empty(k)
    for i in range(k):
        theta = x[i, 3 * n : 3 * n + LAW]
        dx, dy, dz = p[i, 0] - theta[SX], p[i, 1] - theta[SY], p[i, 2] - theta[SZ]
        c[i], r, rarity = concentration_at(dx, dy, dz, theta, gas.r_ref_m, gas.radius_m, grad[i])
        if gas.shape.kind:
            place, first = (p[i, 0], p[i, 1], p[i, 2]), (c[i], r, rarity)
            c[i], r, rarity = field_of_shape(place, theta, gas.shape, (gas.r_ref_m, gas.radius_m), first, grad[i], by_shape)
        for a in range(3):
            by_nose[i, a] = against_nose(gas.shape.kind, grad[i], by_shape, a)
        speed2 = 0.0
        for a in range(3):
            velocity = 0.0
            for j in range(n):
                velocity += jac[i, a, j] * dq[j] if abs(dq[j]) > gas.rest_speed_rad_s else 0.0
            speed2 += velocity * velocity
        by_jitter, by_discrepancy = theta[EXPONENT] * gas.nose_jitter_m / r, gas.model_discrepancy * np.log(r / gas.r_ref_m)
        amplitude[i] = c[i] * np.sqrt(rarity + (by_jitter * by_jitter + by_discrepancy * by_discrepancy) / (gas.gamma * gas.gamma))
        wind2 = grad[i, KX] * grad[i, KX] + grad[i, KY] * grad[i, KY] + grad[i, KZ] * grad[i, KZ]
        of_sway = c[i] * gas.sway / (gas.gamma * r) * np.sqrt(wind2)
        amplitude[i], t[i] = with_sway(amplitude[i], r / (gas.r_ref_m / gas.t_s + np.sqrt(speed2)), of_sway, gas.sway_s)
        tau[i] = gas.rise_s if c[i] + amplitude[i] * x[i, relative] > x[i, lagged] else gas.fall_s
        numbers[0, i], numbers[1, i], numbers[2, i], numbers[3, i] = tau[i], t[i], amplitude[i], r
    return c, grad, by_nose, lagged_ou_steps(np.full(k, dt), tau, t, amplitude, gas.gamma * gas.gamma)


@compiled
def _propagate_gas(
    x: Array, e: int, count: int, c: Array, gradients: tuple[Array, Array], jac: Array, steps: Array, dt: float
) -> Array:  # fmt: skip
    """Advance f and m of place e of x (k, N) in place; returns the rows of F for f (k, N)."""
    k, n = x.shape[0], jac.shape[2]
    lagged, relative = x.shape[1] - 2 * count + e, x.shape[1] - count + e
    grad, by_nose = gradients
    rows = np.zeros(x.shape)
    for i in range(k):
        phi, coupling, keep = steps[i, 0], steps[i, 1], steps[i, 2]
        lag_input = (1.0 - phi) * c[i] + coupling * x[i, relative]
        for j in range(n):
            df_do = lag_input * (by_nose[i, 0] * jac[i, 0, j] + by_nose[i, 1] * jac[i, 1, j] + by_nose[i, 2] * jac[i, 2, j])
            rows[i, j], rows[i, n + j], rows[i, 2 * n + j] = df_do, dt * df_do, 0.5 * dt * dt * df_do
        for j in range(LAW):
            rows[i, 3 * n + j] = lag_input * grad[i, j]
        rows[i, lagged], rows[i, relative] = phi, coupling
        x[i, lagged], x[i, relative] = phi * x[i, lagged] + lag_input, keep * x[i, relative]
    return rows


@compiled
def apply_transition(a: Array, rows: Array, step: Array, dt: float, n: int) -> Array:
    """Return the product F a (N, p), with the rows of F for f (P, N)."""
    out, half, count = a.copy(), 0.5 * dt * dt, len(rows)
    for e in range(count):
        f = a.shape[0] - 2 * count + e
        out[f] = 0.0
        for j in range(a.shape[0]):
            if rows[e, j] != 0.0:
                for p in range(a.shape[1]):
                    out[f, p] += rows[e, j] * a[j, p]
    for j in range(n):
        for p in range(a.shape[1]):
            out[j, p] += dt * a[n + j, p] + half * a[2 * n + j, p]
            out[n + j, p] += dt * a[2 * n + j, p]
    for e in range(count):
        for p in range(a.shape[1]):
            out[a.shape[0] - count + e, p] *= step[OU * e + 2]
    return out


@compiled
def apply_transition_transposed(a: Array, rows: Array, step: Array, dt: float, n: int) -> Array:
    """Return the product F' a (N,)."""
    out, count, size = a.copy(), len(rows), len(a)
    for e in range(count):
        out[size - 2 * count + e], out[size - count + e] = 0.0, step[OU * e + 2] * a[size - count + e]
    for e in range(count):
        for j in range(size):
            out[j] += rows[e, j] * a[size - 2 * count + e]
    for j in range(n):
        out[2 * n + j] += dt * a[n + j] + 0.5 * dt * dt * a[j]
        out[n + j] += dt * a[j]
    return out


@compiled
def propagate_covariance(cov: Array, rows: Array, step: Array, dt: float, n: int, walk: Array, drift: float) -> Array:
    """Return F P F' + Q (N, N), symmetric to the bit."""
    half = apply_transition(cov.copy(), rows, step, dt, n)  # a belief's is read-only: of one type with `turned`, it is compiled once
    turned = np.empty((half.shape[1], half.shape[0]))  # half.T.copy()
    for i in range(half.shape[0]):
        for j in range(half.shape[1]):
            turned[j, i] = half[i, j]
    out = apply_transition(turned, rows, step, dt, n)
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
    count = 1 if len(step) == OU else 2
    f, m = size - 2 * count, size - count
    for e in range(count):
        out[f + e, f + e] += step[OU * e + 3]
        out[f + e, m + e] += step[OU * e + 4]
        out[m + e, f + e] = out[f + e, m + e]
        out[m + e, m + e] += step[OU * e + 5]
    if count == 2:
        for i, j, number in ((f, f + 1, 0), (f, m + 1, 1), (m, f + 1, 2), (m, m + 1, 3)):
            out[i, j] += step[2 * OU + number]
            out[j, i] = out[i, j]
    return out


@compiled
def predict(
    mean: Array, cov: Array, dt: float, q: Array, dq: Array, chain: SerialChain, gas: GasConstants, walk: Array, drift: float
) -> tuple[Array, Array]:
    """EKF time update: x = f(x) (N,), P = F P F' + Q (N, N)."""
    new, rows, steps = propagate(mean.copy().reshape(1, -1), dt, q, dq, chain, gas)
    return new[0], propagate_covariance(cov, rows[0], steps[0], dt, len(q), walk, drift)
