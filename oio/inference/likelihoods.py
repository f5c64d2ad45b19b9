"""Likelihood of fluctuation parameters on a grid, for the residuals of one fit, and the maximum-likelihood parameters.

The results equal those of `oio.gas.whitening.whiten`, one by one, to the bit, but shared terms are computed once: the decay of the lag
over every step, that of the fluctuation for every correlation time, and the amplitude for every shape.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from oio.core.compiled import compiled
from oio.core.records import Array
from oio.gas.fluctuation import Fluctuation, PathField, fluctuation_ppm, lagged_ou_step
from oio.gas.sway_whitening import sway_filter, sway_height, sway_steps
from oio.gas.whitening import Whitened, whiten, whitening_filter

GAMMAS = np.geomspace(0.005, 1.5, 18)
TIMES_S = np.geomspace(0.1, 10.0, 10)
NO_STEPS = np.empty((0, 0))  # of a sway, where there is none


def fit_fluctuation(residual: Array, along: PathField, like: Fluctuation) -> Fluctuation:
    """Noise with the maximum-likelihood gamma and T, on a grid, for the residuals (m,) of a fit; the rest as `like`."""
    shapes = [(along.field.slope_m, along.field.model_discrepancy, float(gamma)) for gamma in GAMMAS]
    costs = minus_2_log_likelihoods(residual, along, like, shapes, TIMES_S)
    gamma, t_s = np.unravel_index(np.argmin(costs), costs.shape)
    return replace(like, gamma=float(GAMMAS[gamma]), t_s=float(TIMES_S[t_s]))


def minus_2_log_likelihoods(
    residual: Array, along: PathField, like: Fluctuation, shapes: list[tuple[float, float, float]], times_s: Array
) -> Array:
    """-2 ln L (s, t), up to a constant, of residuals (m,) along a path, for shapes (n u_p [m], w, gamma) and times (t,) [s] of the eddies;
    white noise and sway as `like`."""
    if along.second is not None:
        return _of_a_pair(residual, along, like, shapes, times_s)
    f, squares = along.field, np.array([gamma**2 for _, _, gamma in shapes])
    path = f.mean_ppm, f.rarity, f.r_m, f.speed_m_s, along.dt_s, along.tau_s
    grid = np.array(shapes), squares, times_s, f.r_ref_m
    sway = (sway_steps(along.dt_s, along.tau_s, like.sway, like.sway_s), sway_height(f)) if like.sway > 0.0 else (NO_STEPS, NO_STEPS)
    white = like.scale * along.variance_ppm2
    rows, expected = _whiten_all(np.ascontiguousarray(residual[:, None]), along.at, path, grid, (*sway, like.sway**2), along.gain, white)
    m = len(residual)
    pairs = zip(rows.reshape(-1, m, 1), expected.reshape(-1, m), strict=True)
    return np.array([Whitened(*pair).minus_2_log_likelihood for pair in pairs]).reshape(len(shapes), len(times_s))


def _of_a_pair(residual: Array, along: PathField, like: Fluctuation, shapes: list[tuple[float, float, float]], times_s: Array) -> Array:
    """The same for two places, one by one."""
    assert along.second is not None
    column, costs = np.ascontiguousarray(residual[:, None]), np.empty((len(shapes), len(times_s)))
    for i, (slope, w, gamma) in enumerate(shapes):
        one, other = (replace(field, slope_m=slope, model_discrepancy=w) for field in (along.field, along.second.field))
        shaped = replace(along, field=one, second=replace(along.second, field=other))
        for j, t_s in enumerate(times_s):
            costs[i, j] = whiten(column, shaped, replace(like, gamma=gamma, t_s=float(t_s))).minus_2_log_likelihood
    return costs


@compiled
def _whiten_all(
    column: Array, at: NDArray[np.int64], path: tuple[Array, Array, Array, Array, Array, Array],
    grid: tuple[Array, Array, Array, float], sway: tuple[Array, Array, float], gain: Array, white: Array,
) -> tuple[Array, Array]:  # fmt: skip
    """Whitened residuals and innovation variances, each (s, t, m), of residuals (m, 1)."""
    mean, rarity, r, speed, dt, tau = path
    shapes, squares, times, r_ref = grid
    k, n_shapes, n_times = len(dt), len(shapes), len(times)
    t, phi, keep = np.empty((n_times, k)), np.exp(-dt / tau), np.empty((n_times, k))
    for i in range(n_times):
        for j in range(k):
            t[i, j] = r[j] / (r_ref / times[i] + speed[j])
            keep[i, j] = np.exp(-dt[j] / t[i, j])
    out, expected = np.empty((n_shapes, n_times, len(at))), np.empty((n_shapes, n_times, len(at)))
    steps, amplitude = np.empty((k, 6)), np.empty(k)
    for s in range(n_shapes):
        slope, w, gamma = shapes[s]
        for j in range(k):
            amplitude[j] = fluctuation_ppm(mean[j], rarity[j], r[j], slope, w, r_ref, gamma)
        for i in range(n_times):
            for j in range(k):
                lagged_ou_step(phi[j], keep[i, j], dt[j], tau[j], t[i, j], amplitude[j], gamma * gamma, steps[j])
            if len(sway[0]):
                rows, ppm2 = sway_filter(column, at, steps, sway[0], sway[1], (squares[s], sway[2]), gain, white)
            else:
                rows, ppm2 = whitening_filter(column, at, steps, squares[s], gain, white)
            for j in range(len(at)):
                out[s, i, j], expected[s, i, j] = rows[j, 0], ppm2[j]
    return out, expected
