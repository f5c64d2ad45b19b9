"""Many places of the source ranked at once: what each would have smelt like along one path of the nose, its strength fitted."""

import numpy as np
from numpy.typing import NDArray

from oio.core.compiled import compiled
from oio.core.records import Array
from oio.gas.range_law import MAX_LN_C, SX, SY, SZ, log_concentration
from oio.inference.forward_kernel import Lag, LawScale, lag_step


@compiled
def grid_costs(
    thetas: Array, nose: Array, dt: Array, at: NDArray[np.int64], gain: Array, start: float, law: LawScale, lag: Lag,
    left: Array, z: Array, weight: Array,
) -> tuple[Array, Array]:  # fmt: skip
    """For theta (j, P) that differ in source and strength alone: weighted sums of squares (j,) with the strength of least squares, and how
    much greater than theta's the latter's logarithm is (j,).

    nose (k, 3) m, dt (k,) s and the lag's beginning are the path's; readings (m,) have a place on it, a gain, what is `left` of
    the beginning, what is above that (z), and a weight. `law`: r_ref and radius [m]. `lag`: rise and fall [s].
    """
    costs, more, h = np.empty(len(thetas)), np.empty(len(thetas)), np.empty(len(at))
    steps = np.empty((len(dt), 2, 2))  # phi and w0 + phi of every step, for rise and fall
    for i in range(len(dt)):
        for j in range(2):
            steps[i, j, 0], steps[i, j, 1], _ = lag_step(dt[i], lag[j])
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
        costs[j], more[j] = cost, np.log(factor)
    return costs, more


@compiled
def _expected_readings(
    theta: Array, nose: Array, at: NDArray[np.int64], gain: Array, start: float, law: LawScale, steps: Array, h: Array
) -> None:
    """h (m,) ppm: the readings expected, without offsets."""
    f, c, reading = start, 0.0, 0
    for i in range(len(nose)):
        ln_c, _, _, _ = log_concentration(
            nose[i, 0] - theta[SX], nose[i, 1] - theta[SY], nose[i, 2] - theta[SZ], theta, law.r_ref_m, law.radius_m
        )
        now = np.exp(min(ln_c, MAX_LN_C))
        before, c = (c if i > 0 else now), now
        step = steps[i, 0 if c > f else 1]
        f = step[0] * f + (step[1] - step[0]) * before + (1.0 - step[1]) * c
        while reading < len(at) and at[reading] == i:
            h[reading] = gain[reading] * f
            reading += 1
