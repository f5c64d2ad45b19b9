"""What the beacon's readings say of the noise: the free play and the straying that made them are chosen."""

from dataclasses import replace

import numpy as np
import pytest

from oio.beacon import _strayed, fit_beacon
from oio.fluctuation import Fluctuation

CALM = Fluctuation(1.0, 0.02, 0.3)
SEEDS = (900, 901, 902)
PLAYS_M, STRAYS = (0.001, 0.002, 0.003), (0.0, 0.05, 0.1, 0.2, 0.3)


def beacon(lab, play_m, stray, seed):
    """A lab, the truth, and readings about a source whose place is known, made with so much free play and straying."""
    made = lab(3, 1, seed=seed)
    made.law = replace(made.law, air="all", nose_u_m=play_m, nose_choices_m=PLAYS_M, stray=stray, stray_choices=STRAYS, calm_evidence=0.0)
    theta = made.theta()
    problem = made.problem(theta, poses=20, noise=CALM)
    mean, cov = np.array(problem.mean), np.array(problem.cov)
    mean[:4], cov[:3, :], cov[:, :3] = theta[:4], 0.0, 0.0
    cov[range(3), range(3)] = 1e-6
    return made, theta, replace(problem, mean=mean, cov=cov)


def beginning(problem, play_m, stray):
    """The same readings, with what is thought of the noise before."""
    return replace(problem, law=replace(problem.law, nose_u_m=play_m, stray=stray))


def steps_off(found, true, choices):
    return abs(choices.index(found) - choices.index(true))


@pytest.mark.parametrize(("play_m", "stray"), [(0.001, 0.0), (0.003, 0.0), (0.002, 0.1), (0.001, 0.3), (0.003, 0.3)])
def test_free_play_and_straying_are_those_that_made_the_readings(lab, play_m, stray):
    """At the truth: never two choices off, and the very ones more often than not. It does not matter what was thought before."""
    right = 0
    for seed in SEEDS:
        _, theta, problem = beacon(lab, play_m, stray, seed)
        found = set()
        for before in ((0.003, 0.2), (0.001, 0.0)):
            begun = beginning(problem, *before)
            expected = begun.predict(theta)
            found.add(_strayed(begun, CALM, begun.residual(theta, expected.ppm), expected.along))
        (law,) = found
        assert steps_off(law.nose_u_m, play_m, PLAYS_M) < 2 and steps_off(law.stray, stray, STRAYS) < 2
        right += (law.nose_u_m, law.stray) == (play_m, stray)
    assert 2 * right > len(SEEDS)


@pytest.mark.parametrize("stray", [0.0, 0.3])
def test_the_fit_is_made_with_what_it_found(lab, stray):
    """The law of a fit differs from that of its problem in these two alone; a plume that strays is told from one that does not."""
    for seed in SEEDS:
        _, _, problem = beacon(lab, 0.001, stray, seed)
        law = fit_beacon(beginning(problem, 0.003, 0.2), 1.0).law
        assert replace(law, nose_u_m=problem.law.nose_u_m, stray=problem.law.stray) == problem.law
        assert law.stray <= 0.05 if stray == 0.0 else law.stray >= 0.2


def test_calm_is_believed_on_strong_evidence_only(lab):
    """Readings that stray by nothing speak for it by tens; what costs more than they say leaves the usual straying."""
    for evidence, calm in ((0.0, True), (10.0, True), (1e4, False)):
        for seed in SEEDS:
            _, theta, problem = beacon(lab, 0.001, 0.0, seed)
            begun = beginning(problem, 0.003, 0.2)
            begun = replace(begun, law=replace(begun.law, usual_nose_u_m=0.002, usual_stray=0.1, calm_evidence=evidence))
            expected = begun.predict(theta)
            law = _strayed(begun, CALM, begun.residual(theta, expected.ppm), expected.along)
            assert (law.stray <= 0.05) == calm
            assert calm or (law.nose_u_m, law.stray) == (0.002, 0.1)


def test_one_choice_is_no_choice(lab):
    _, _, problem = beacon(lab, 0.003, 0.3, SEEDS[0])
    fixed = replace(problem, law=replace(problem.law, nose_choices_m=(0.002,), stray_choices=(0.1,)))
    law = fit_beacon(fixed, 1.0).law
    assert (law.nose_u_m, law.stray) == (0.002, 0.1)
