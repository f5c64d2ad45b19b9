"""The belief with which a filter begins: what a batch fit found, carried to the present."""

import numpy as np

from oio.core.records import Array, Belief, seconds
from oio.gas.range_law import LAW
from oio.inference.map_fit import Fit
from oio.inference.state_space import StateSpace


def initial_belief(model: StateSpace, fit: Fit, t_ns: int, measurements: int) -> Belief:
    """Return the belief (N,), (N, N) after a fit of `measurements` measurements, drift propagated exactly to t_ns; P0 widened by the
    assembly."""
    at, t = model.at, seconds(t_ns)
    transform = _from_parameters(model, fit, t)
    mean, cov = transform @ fit.mean, transform @ fit.cov @ transform.T
    f, m, fl, places = at["f"], at["m"], model.fluctuation, model.places
    correlation = np.full((places, places), np.exp(-model.arm.spacing_m / model.law.r_ref_m))
    np.fill_diagonal(correlation, 1.0)
    lagged = np.array(fit.lagged_ppm_at if places > 1 and fit.lagged_ppm_at else (fit.lagged_ppm,) * places)
    mean[f], cov[m, m] = lagged, fl.gamma**2 * correlation
    cov[f, f] = np.outer(fl.gamma * lagged, fl.gamma * lagged) * correlation + model.sigma_ppm**2 * np.eye(places)
    share = min(model.noise.measurements / max(measurements, 1), 1.0)
    cov[at["s"], at["s"]] += share * model.noise.source_p0_m2 * np.eye(3)
    cov[np.diag_indices(model.size)] += 1e-18
    return Belief(t_ns, mean, cov)


def _from_parameters(model: StateSpace, fit: Fit, t_s: float) -> Array:
    """The state (N, P) at t_s by the parameters of the fit. What changed with time is as at its last knot."""
    at, lay, extension = model.at, fit.layout, fit.extension
    transform, eye, base = np.zeros((model.size, lay.size)), np.eye(model.arm.dof), fit.layout.base
    transform[at["o"], lay.offset], transform[at["o"], lay.drift] = eye, 0.5 * t_s * t_s * eye
    transform[at["v"], lay.drift], transform[at["a"], lay.drift] = t_s * eye, eye
    transform[at["s"].start : at["b"].start, :LAW] = np.eye(LAW)
    transform[at["b"], lay.baseline] = np.eye(model.elements)
    if extension.strength:
        transform[at["l"], base + extension.strength[-1]] = 1.0
    if extension.wind:
        transform[at["k"], base + np.array(extension.wind[-3:])] += np.eye(3)
    if extension.background:
        transform[at["b"], base + extension.background[-1]] = np.array(model.gain)
    if extension.joints:
        drift, t = base + np.array(extension.drift), t_s - extension.begins_s
        for block, factor in (("o", 0.5 * t * t), ("v", t), ("a", 1.0)):
            transform[at[block], drift] = factor * np.eye(len(drift))
    return transform
