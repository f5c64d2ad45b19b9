"""No estimate beats the Cramer-Rao bound; more readings and less noise lower it."""

from dataclasses import replace

import numpy as np
import pytest

from oio.batch import solve
from oio.beliefs import problem_of
from oio.bounds import at_truth, cramer_rao
from oio.fluctuation import Fluctuation
from oio.knowledge import Knowledge


def test_the_fit_does_not_beat_the_bound_and_comes_near_it(lab):
    ratios = []
    for seed in range(20):
        made = lab(3, 1, seed=300 + seed)
        theta = made.theta()
        sniffs = made.problem(theta, poses=12).sniffs
        fit = solve(problem_of(sniffs, made.known), theta, made.model.fluctuation)
        ratios.append(np.linalg.norm(fit.mean[:3] - theta[:3]) / cramer_rao(sniffs, made.known, theta))
    efficiency = np.sqrt(np.mean(np.square(ratios)))
    assert 0.8 * 0.8 < efficiency < 2.0, efficiency  # 0.8, and the scatter of an RMS of 20
    assert efficiency == pytest.approx(1.0, abs=0.4)


def test_more_readings_and_calmer_air_lower_the_bound(lab):
    made = lab(3, 1, seed=1)
    theta = made.theta()
    sniffs = made.problem(theta, poses=12).sniffs
    whole, half = (cramer_rao(s, made.known, theta) for s in (sniffs, sniffs.between(0.0, 12.0)))
    assert 0 < whole < half
    calm = Knowledge(made.mean, made.cov, replace(made.model, fluctuation=Fluctuation(1.0, 0.02, 0.3)))
    assert cramer_rao(sniffs, calm, theta) < whole


def test_knowing_the_nuisances_less_raises_the_bound(lab):
    made = lab(3, 1, seed=2)
    theta = made.theta()
    sniffs = made.problem(theta, poses=12).sniffs
    vague = Knowledge(made.mean, 4.0 * made.cov, made.model)
    assert cramer_rao(sniffs, vague, theta) > cramer_rao(sniffs, made.known, theta)


def test_the_bound_does_not_hang_on_what_was_believed_of_the_source(lab):
    made = lab(3, 1, seed=3)
    theta = made.theta()
    sniffs, cov = made.problem(theta, poses=12).sniffs, np.array(made.cov)
    cov[range(4), range(4)] *= 1e-2
    sure = Knowledge(made.mean, cov, made.model)
    assert cramer_rao(sniffs, sure, theta) == pytest.approx(cramer_rao(sniffs, made.known, theta), rel=1e-6)


def test_at_truth_keeps_the_place_and_finds_the_strength(lab):
    made = lab(3, 1, seed=4)
    theta = made.theta()
    sniffs, wrong = made.problem(theta, quiet=True).sniffs, np.array(theta)
    wrong[:4] += 0.1
    found = at_truth(sniffs, made.known, wrong, theta[:3])
    np.testing.assert_array_equal(found[:3], theta[:3])
    assert found[3] == pytest.approx(theta[3], abs=0.02)
