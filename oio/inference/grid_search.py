"""Grid search over source positions: cost of the readings predicted along one nose path, with the strength fitted at each position."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from oio.core.compiled import compiled
from oio.core.records import Array
from oio.gas.range_law import MAX_LN_C, SX, SY, SZ, log_concentration
from oio.inference.extension_kernel import LawScale
from oio.inference.forward_kernel import Lag, lag_step


class Course(NamedTuple):
    """Path of one of two places from its first reading on, and the readings from there."""

    nose: Array  # (k, 3) [m]
    dt: Array  # (k,) [s]
    at: NDArray[np.int64]  # (m,), path index of each reading
    gain: Array  # (m,)
    start: float  # initial lag state [ppm]


def grid_costs_of_pair(
    thetas: Array, courses: list[Course], is_second: NDArray[np.bool_], law: LawScale, lag: Lag, readings: tuple[Array, Array, Array]
) -> tuple[Array, Array]:
    """As `grid_costs`, of readings from two places; which of them (m,) are from the second; `readings`: left, z and weight, each (m,)."""
    (left, z, weight), h = readings, np.empty((len(thetas), len(is_second)))
    for course, here in zip(courses, (~is_second, is_second), strict=True):
        h[:, here] = _grid_readings(thetas, course.nose, course.dt, course.at, course.gain, course.start, law, lag)
    h -= left
    factor = np.maximum(h @ (weight * z) / np.maximum((h * h) @ weight, 1e-300), 1e-6)
    return (z - factor[:, None] * h) ** 2 @ weight, np.log(factor)


@compiled
def _grid_readings(
    thetas: Array, nose: Array, dt: Array, at: NDArray[np.int64], gain: Array, start: float, law: LawScale, lag: Lag
) -> Array:
    """Predicted readings (j, m) [ppm], without offsets, of thetas (j, P)."""
    steps, h = _lag_steps(dt, lag), np.empty((len(thetas), len(at)))
    for j in range(len(thetas)):
        _expected_readings(thetas[j], nose, at, gain, start, law, steps, h[j])
    return h


@compiled
def _lag_steps(dt: Array, lag: Lag) -> Array:
    """phi and w0 + phi of every step, for rise and fall (k, 2, 2)."""
    steps = np.empty((len(dt), 2, 2))
    for i in range(len(dt)):
        for j in range(2):
            steps[i, j, 0], steps[i, j, 1], _ = lag_step(dt[i], lag[j])
    return steps


@compiled
def grid_costs(
    thetas: Array, nose: Array, dt: Array, at: NDArray[np.int64], gain: Array, start: float, law: LawScale, lag: Lag,
    left: Array, z: Array, weight: Array,
) -> tuple[Array, Array]:  # fmt: skip
    """Costs of theta (j, P) that differ in source and strength alone: weighted sums of squares (j,) at the least-squares strength, and
    its ln ratio to that of theta (j,).

    Path: nose (k, 3) [m], dt (k,) [s], initial lag state `start` [ppm]. Readings (m,): path index `at`, gain, decay of the lag's initial
    state (`left`), signal above that (z) [ppm], and weight. `law`: r_ref and radius [m]. `lag`: rise and fall [s].
    """
    costs, ln_factors, h = np.empty(len(thetas)), np.empty(len(thetas)), np.empty(len(at))
    steps = _lag_steps(dt, lag)
    for j in range(len(thetas)):
        _expected_readings(thetas[j], nose, at, gain, start, law, steps, h)
        hz, hh, cost = 0.0, 0.0, 0.0
        for i in range(len(at)):
            h[i] -= left[i]
            hz += weight[i] * h[i] * z[i]
            hh += weight[i] * h[i] * h[i]
        factor = max(hz / max(hh, 1e-300), 1e-6)
        for i in range(len(at)):
            cost += weight[i] * (z[i] - factor * h[i]) ** 2
        costs[j], ln_factors[j] = cost, np.log(factor)
    return costs, ln_factors


@compiled
def _expected_readings(
    theta: Array, nose: Array, at: NDArray[np.int64], gain: Array, start: float, law: LawScale, steps: Array, h: Array
) -> None:
    """Fill h (m,) [ppm] with the predicted readings, without offsets."""
    f, c, reading = start, 0.0, 0
    for i in range(len(nose)):
        ln_c, _, _, _ = log_concentration(
            nose[i, 0] - theta[SX], nose[i, 1] - theta[SY], nose[i, 2] - theta[SZ], theta, law.r_ref_m, law.radius_m
        )
        current = np.exp(min(ln_c, MAX_LN_C))
        previous, c = (c if i > 0 else current), current
        step = steps[i, 0 if c > f else 1]
        f = step[0] * f + (step[1] - step[0]) * previous + (1.0 - step[1]) * c
        while reading < len(at) and at[reading] == i:
            h[reading] = gain[reading] * f
            reading += 1
