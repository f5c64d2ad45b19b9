"""The fit on a source whose place is known: range law, wind, gains, lag, offsets, encoder drift, and how the gas fluctuates."""

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
from oio.inference.prior import Nominal, nominal_prior
from oio.kinematics.arm import Arm

GUESS = 0.3  # gamma to begin with: too large loses a little, too small chases eddies
ROUNDS = 4  # of answer and fluctuation in turn, at most
WINDS = 6  # directions of wind tried besides none: the likelihood of the wind has several hills


def beacon_problem(
    sniffs: Sniffs, arm: Arm, law: RangeLaw, nominal: Nominal, offsets: tuple[Array, Array], place: tuple[Array, float]
) -> Problem:
    """The fit with the source at place (3,) m, known to a standard uncertainty [m] per axis, and offsets (E,) ppm with theirs."""
    mean, cov = nominal_prior(arm, law, nominal, *offsets)
    mean[SOURCE] = place[0]
    cov[SOURCE, SOURCE][np.diag_indices(3)] = place[1] ** 2
    signal = sniffs.ppm - offsets[0][sniffs.element]
    mean[ParameterLayout(arm.dof, nominal.elements).gain] = _start_gains(signal, sniffs.element, nominal)
    first = sniffs.element == 0
    mean[LN_STRENGTH] = np.log(max(float(np.max(signal[first] if np.any(first) else signal)), nominal.sigma_ppm))
    return Problem(sniffs, arm, law, nominal.elements, nominal.rise_s, nominal.fall_s, mean, cov)


def _start_gains(signal: Array, element: NDArray[np.int64], nominal: Nominal) -> Array:
    """ln of how many times what the first element felt each element felt in all (E,): where a fit begins.

    Specimens differ by factors, and noise that grows with the signal forgives a fit any expectation that is much too large. An element
    that was never read is taken for its twin's like.
    """
    parts = [signal[element == e] for e in range(nominal.elements)]
    felt = np.array([max(float(np.mean(part)), nominal.sigma_ppm) if len(part) else np.nan for part in parts])
    return np.asarray(np.nan_to_num(np.log(felt / felt[0])))


def fit_beacon(problem: Problem, noise_scale: float, like: Fit | None = None) -> Fit:
    """The fit with the air that the law names or that the evidence chooses, or begun `like` a fit of much the same data, with its air."""
    if like is not None:
        return _alternate(hold_parameters(problem, law_form(like)), noise_scale, like)
    forms = tuple(HELD_BY_FORM) if problem.law.form == "evidence" else (problem.law.form,)
    problems = [hold_parameters(problem, form) for form in forms]
    return lowest_bic((p, _alternate(p, noise_scale, _best_start(p, noise_scale))) for p in problems)


def _best_start(problem: Problem, noise_scale: float) -> Fit:
    """Best of still air and WINDS winds by likelihood."""
    guess = Fluctuation(noise_scale, GUESS, problem.law.eddy_s)
    return min((solve(problem, start, guess) for start in _wind_starts(problem)), key=lambda f: f.chi2)


def _alternate(problem: Problem, noise_scale: float, fit: Fit) -> Fit:
    """What the readings say of the noise, and the answer, in turn."""
    for _ in range(ROUNDS):
        problem = replace(problem, law=fit.law)
        expected = problem.predict(fit.mean)
        residual = problem.residual(fit.mean, expected.ppm)
        noise = fit_fluctuation(residual, expected.along, noise_scale)
        law = _fit_discrepancy(problem, noise, residual, expected.along)
        if noise == fit.fluctuation and law == fit.law:
            break
        fit = solve(replace(problem, law=law), fit.mean, noise)
    return fit


def _fit_discrepancy(problem: Problem, noise: Fluctuation, residual: Array, along: PathField) -> RangeLaw:
    """The law with the free play and the straying that make the residuals (m,) likeliest.

    Calmer than is usual counts as such only on very strong evidence: a beacon's few minutes of moving gas do not tell little straying from
    none, and the next source is smelt elsewhere in the plume. Where the law holds the readings do say so, by tens.
    """
    law = problem.law
    choices = [(jitter_m, w) for jitter_m in law.nose_jitter_choices_m for w in law.model_discrepancy_choices]
    shapes = [(along.field.slope_m / law.nose_jitter_m * jitter_m, w, noise.gamma) for jitter_m, w in choices]
    costs = minus_2_log_likelihoods(residual, along, noise.scale, shapes, np.array([noise.t_s]))[:, 0]
    jitter_m, w = choices[int(np.argmin(costs + [law.calm_penalty(jitter_m, w) for jitter_m, w in choices]))]
    return replace(law, nose_jitter_m=jitter_m, model_discrepancy=w)


def _wind_starts(problem: Problem) -> list[Array]:
    starts = [problem.mean]
    if problem.cov[KX, KX] < problem.law.wind_per_m_u**2:  # the wind is held
        return starts
    for angle in 2 * np.pi * np.arange(WINDS) / WINDS:
        start = np.array(problem.mean)
        start[[KX, KY]] = 1.3 * problem.law.wind_per_m_u * np.array([np.cos(angle), np.sin(angle)])
        starts.append(start)
    return starts
