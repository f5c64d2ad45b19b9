"""Calibration fit on a beacon, a source at a known position: range law, wind, gains, lag, offsets, encoder drift, gas fluctuation."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from oio.core.records import Array
from oio.gas.fluctuation import Fluctuation, PathField
from oio.gas.range_law import KX, KY, LN_STRENGTH, SOURCE, RangeLaw
from oio.gas.trace import Sniffs
from oio.inference.forward_model import ParameterLayout, Problem
from oio.inference.likelihoods import fit_fluctuation, minus_2_log_likelihoods
from oio.inference.map_fit import Fit, solve
from oio.inference.model_selection import HELD_BY_FORM, hold_parameters, law_form, lowest_bic
from oio.inference.noise_evidence import likeliest_sway, linearised
from oio.inference.prior import Nominal, nominal_prior
from oio.kinematics.arm import Arm

INITIAL_GAMMA = 0.3  # initial gamma: too large costs a little precision, too small makes the fit follow eddies
MAX_ALTERNATIONS = 4  # maximum number of alternations between fit and noise estimation
SWAY_ALTERNATIONS = 2  # between the sway's evidence and the fit
WINDS = 6  # wind directions tried as starts besides still air: the likelihood of the wind is multimodal


def beacon_problem(
    sniffs: Sniffs, arm: Arm, law: RangeLaw, nominal: Nominal, offsets: tuple[Array, Array], place: tuple[Array, float]
) -> Problem:
    """Fit problem of a source at `place`: position (3,) [m] and standard uncertainty per axis [m]; `offsets` (E,) [ppm] and theirs."""
    mean, cov = nominal_prior(arm, law, nominal, *offsets)
    mean[SOURCE] = place[0]
    cov[SOURCE, SOURCE][np.diag_indices(3)] = place[1] ** 2
    signal = sniffs.ppm - offsets[0][sniffs.element]
    mean[ParameterLayout(arm.dof, nominal.elements).gain] = _start_gains(signal, sniffs.element, nominal)
    first = sniffs.element == 0
    mean[LN_STRENGTH] = np.log(max(float(np.max(signal[first] if np.any(first) else signal)), nominal.sigma_ppm))
    return Problem(sniffs, arm, law, nominal.elements, nominal.rise_s, nominal.fall_s, mean, cov)


def _start_gains(signal: Array, element: NDArray[np.int64], nominal: Nominal) -> Array:
    """Start values of the ln gains (E,): ln of each element's mean signal over that of the first element.

    Specimens differ by factors, and with noise that grows with the signal, a prediction that is much too large costs the fit little. An
    element without readings starts at the gain of the first.
    """
    parts = [signal[element == e] for e in range(nominal.elements)]
    mean_signal = np.array([max(float(np.mean(part)), nominal.sigma_ppm) if len(part) else np.nan for part in parts])
    return np.asarray(np.nan_to_num(np.log(mean_signal / mean_signal[0])))


def fit_beacon(problem: Problem, noise_scale: float, like: Fit | None = None) -> Fit:
    """Fit with the configured form of the range law, or that of lowest BIC ("evidence"); `like`: start and form from an earlier fit."""
    if like is not None:
        return _alternate(hold_parameters(problem, law_form(like)), noise_scale, like)
    forms = tuple(HELD_BY_FORM) if problem.law.form == "evidence" else (problem.law.form,)
    problems = [hold_parameters(problem, form) for form in forms]
    best = lowest_bic((p, _alternate(p, noise_scale, _best_start(p, noise_scale))) for p in problems)
    return _with_sway(replace(hold_parameters(problem, law_form(best)), law=best.law), best)


def _best_start(problem: Problem, noise_scale: float) -> Fit:
    """Fit of highest posterior among starts in still air and in WINDS wind directions."""
    guess = Fluctuation(noise_scale, INITIAL_GAMMA, problem.law.eddy_s)
    return min((solve(problem, start, guess) for start in _wind_starts(problem)), key=lambda f: f.chi2)


def _alternate(problem: Problem, noise_scale: float, fit: Fit) -> Fit:
    """Alternate between estimating the noise from the residuals and solving for theta."""
    for _ in range(MAX_ALTERNATIONS):
        problem = replace(problem, law=fit.law)
        expected = problem.predict(fit.mean)
        residual = problem.residual(fit.mean, expected.ppm)
        noise = fit_fluctuation(residual, expected.along, replace(fit.fluctuation, scale=noise_scale))
        law = _fit_discrepancy(problem, noise, residual, expected.along)
        if noise == fit.fluctuation and law == fit.law:
            break
        fit = solve(replace(problem, law=law), fit.mean, noise)
    return fit


def _fit_discrepancy(problem: Problem, noise: Fluctuation, residual: Array, along: PathField) -> RangeLaw:
    """Range law with the nose jitter (backlash) and model discrepancy of greatest likelihood for the residuals (m,).

    Values below the typical ones need very strong evidence: a few minutes of moving gas at a beacon do not separate a small discrepancy
    from none, and the next source is sensed elsewhere in the plume. Where the law holds, -2 ln L differs by tens.
    """
    law = problem.law
    choices = [(jitter_m, w) for jitter_m in law.nose_jitter_choices_m for w in law.model_discrepancy_choices]
    shapes = [(along.field.slope_m / law.nose_jitter_m * jitter_m, w, noise.gamma) for jitter_m, w in choices]
    costs = minus_2_log_likelihoods(residual, along, noise, shapes, np.array([noise.t_s]))[:, 0]
    jitter_m, w = choices[int(np.argmin(costs + [law.calm_penalty(jitter_m, w) for jitter_m, w in choices]))]
    return replace(law, nose_jitter_m=jitter_m, model_discrepancy=w)


def _with_sway(problem: Problem, fit: Fit) -> Fit:
    """Fit with the sway of the plume, of the root mean square strength over its posterior, and with eddies that suit it.

    A few minutes of a plume hold few sways, and a fit of all joints follows them: their strength is found by its evidence, in which the
    posterior of all parameters is integrated out, and not by the likelihood of residuals.
    """
    for _ in range(SWAY_ALTERNATIONS):
        along, columns, prior_u = linearised(problem, fit.mean)
        if along.second is not None:
            return fit  # the filter of two places has no states for it
        fit = solve(problem, fit.mean, likeliest_sway(columns, prior_u, along, fit.fluctuation))
    return fit


def _wind_starts(problem: Problem) -> list[Array]:
    starts = [problem.mean]
    if problem.cov[KX, KX] < problem.law.wind_per_m_u**2:  # the wind is held fixed
        return starts
    for angle in 2 * np.pi * np.arange(WINDS) / WINDS:
        start = np.array(problem.mean)
        start[[KX, KY]] = 1.3 * problem.law.wind_per_m_u * np.array([np.cos(angle), np.sin(angle)])
        starts.append(start)
    return starts
