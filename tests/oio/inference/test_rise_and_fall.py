"""Lags of rise and fall, each by the readings alone: they are those that made the readings, and without gas there is none."""

from dataclasses import replace

import numpy as np
import pytest

from oio.gas.fluctuation import Fluctuation
from oio.inference.map_fit import solve
from oio.inference.rise_and_fall import PRIOR_U, by_ln_fall, rise_and_fall

AIR = Fluctuation(1.0, 0.1, 0.3)
DATA_SHEET_U = 0.15


def beacon(lab, draw, seed, ratio=1.0, ln_strength=None):
    """A beacon's problem whose sensor falls `ratio` times as slowly as its data sheet has it beside the rise; its truth, and the fit."""
    made = lab(3, 1, seed=seed)
    theta = made.theta()
    if ln_strength is not None:
        theta[3] = ln_strength
    problem = made.problem(theta, poses=16, quiet=True)
    mean, cov, lay = np.array(problem.mean), np.array(problem.cov), problem.layout
    mean[:4], cov[:3, :], cov[:, :3] = theta[:4], 0.0, 0.0
    cov[range(3), range(3)], cov[lay.tau, lay.tau] = 1e-6, DATA_SHEET_U**2
    expected = replace(problem, fall_s=ratio * problem.fall_s).predict(theta)
    ppm = expected.ppm + theta[lay.baseline][problem.sniffs.element] + draw(expected.along, AIR, made.rng)[0]
    problem = replace(problem, mean=mean, cov=cov, sniffs=replace(problem.sniffs, ppm=ppm))
    return problem, theta, solve(problem, theta, AIR)


@pytest.mark.parametrize("ratio", [1.0, 1.8])
def test_both_lags_are_those_that_made_the_readings(lab, draw, ratio):
    """Within their uncertainties, on average as often as these say; and a fall that is slower than it should be shows."""
    z = []
    for seed in range(700, 716):
        problem, theta, fit = beacon(lab, draw, seed, ratio)
        found, factor = rise_and_fall(problem, fit), float(np.exp(theta[problem.layout.tau]))
        assert found.fall.tau_s / found.rise.tau_s == pytest.approx(found.ratio * problem.fall_s / problem.rise_s)
        z.append([
            np.log(found.rise.tau_s / (factor * problem.rise_s)) / found.rise.u_ln,
            np.log(found.fall.tau_s / (factor * ratio * problem.fall_s)) / found.fall.u_ln,
            np.log(found.ratio / ratio) / found.ratio_u_ln,
        ])  # fmt: skip
        assert found.rise.u_ln < 0.4 and found.fall.u_ln < 0.2
    square = np.mean(np.square(z), axis=0)
    assert np.all((square > 0.2) & (square < 2.5)), square


def test_a_slow_recovery_is_beyond_doubt(lab, draw):
    problem, _, fit = beacon(lab, draw, 720, ratio=2.5)
    found = rise_and_fall(problem, fit)
    assert np.log(found.ratio) > 3.0 * found.ratio_u_ln


def test_without_gas_the_readings_tell_neither(lab, draw):
    """What the data sheet says is no evidence, though the fit's own lag is as certain as that."""
    problem, _, fit = beacon(lab, draw, 721, ln_strength=-9.0)
    found = rise_and_fall(problem, fit)
    assert 0.5 < found.rise.u_ln <= PRIOR_U + 1e-9 and 0.5 < found.fall.u_ln <= PRIOR_U + 1e-9
    assert float(np.sqrt(fit.cov[problem.layout.tau, problem.layout.tau])) < 1.01 * DATA_SHEET_U


def test_the_derivative_by_the_fall_is_that_of_the_readings(lab, draw):
    problem, theta, _ = beacon(lab, draw, 722)
    tau = problem.layout.tau
    expected = problem.predict(theta)
    found = by_ln_fall(problem, theta, expected)
    slower, faster = (replace(problem, fall_s=problem.fall_s * np.exp(h)).expect(theta) for h in (1e-5, -1e-5))
    np.testing.assert_allclose(found, (slower - faster) / 2e-5, atol=1e-4 * np.max(np.abs(found)))
    of_rise = (replace(problem, rise_s=problem.rise_s * np.exp(1e-5)).expect(theta) - expected.ppm) / 1e-5
    np.testing.assert_allclose(found + of_rise, expected.rows[:, tau], atol=1e-3 * np.max(np.abs(found)))
