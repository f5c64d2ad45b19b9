"""Airs by evidence: what is held stays, what made the data is chosen, and a run's settings name one of them."""

from dataclasses import replace

import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.gas.fluctuation import Fluctuation
from oio.gas.range_law import FORMS, LAW
from oio.inference.beacon_fit import fit_beacon
from oio.inference.map_fit import solve
from oio.inference.model_selection import HELD_BY_FORM, bic, effective_sample_size, hold_parameters, law_form

PLACE = np.array([0.33, 0.05, 0.18])
TRUE = {"log_distance": {4: 1.6}, "isotropic": {8: 6.0}, "advection_diffusion": {5: 8.0, 6: -5.0}}


def beacon(lab, air="evidence", seed=0, true=None, poses=12):
    """Readings about a known source in one kind of air, with a prior as wide as before any calibration."""
    made = lab(3, 1, seed=seed)
    made.law = replace(made.law, form=air, exponent_u=0.5, wind_per_m_u=15.0, lift_per_m_u=3.0, thinning_per_m_u=3.0)
    theta = np.array(made.mean)
    theta[:LAW] = [*PLACE, np.log(20.0), 1.0, 0.0, 0.0, 0.0, 0.0]
    for place, value in (true or {}).items():
        theta[place] = value
    cov = np.array(made.cov)
    cov[range(9), range(9)] = np.array([*[1e-3] * 3, 2.0, 0.5, 15.0, 15.0, 3.0, 3.0]) ** 2
    problem = made.problem(theta, poses=poses, noise=Fluctuation(1.0, 0.1, 0.3))
    mean = np.array(made.mean)
    mean[:4] = *PLACE, np.log(20.0)
    return replace(problem, mean=mean, cov=cov), theta


def test_there_is_a_candidate_for_every_air():
    assert {"evidence", *HELD_BY_FORM} == set(FORMS)


@pytest.mark.parametrize("air", list(HELD_BY_FORM))
def test_what_an_air_holds_stays_and_the_rest_is_free(lab, air):
    problem, _ = beacon(lab, air=air, seed=1)
    fit = fit_beacon(problem, 1.0)
    assert law_form(fit) == air
    for place in range(4, LAW):
        if place in HELD_BY_FORM[air]:
            assert fit.mean[place] == pytest.approx(HELD_BY_FORM[air][place], abs=1e-4)
        else:
            assert fit.cov[place, place] > 1e-6


def test_all_is_the_problem_itself(lab):
    problem, _ = beacon(lab, seed=2)
    same = hold_parameters(problem, "all")
    np.testing.assert_array_equal(same.mean, problem.mean)
    np.testing.assert_array_equal(same.cov, problem.cov)


@pytest.mark.parametrize("air", list(TRUE))
def test_the_air_that_made_the_readings_is_chosen(lab, air):
    chosen = [law_form(fit_beacon(beacon(lab, seed=seed, true=TRUE[air])[0], 1.0)) for seed in (10, 11, 12)]
    assert chosen.count(air) >= 2, chosen


def test_a_fit_like_another_keeps_its_air(lab):
    problem, _ = beacon(lab, seed=3)
    first = fit_beacon(replace(problem, law=replace(problem.law, form="isotropic")), 1.0)
    part = replace(problem, sniffs=problem.sniffs.without(8.0, 12.0))
    assert law_form(fit_beacon(part, 1.0, like=first)) == "isotropic"


def test_a_parameter_that_explains_nothing_costs_ln_n(lab):
    """BIC of two laws that fit alike differ by the number of what they free."""
    problem, theta = beacon(lab, seed=4)
    noise = Fluctuation(1.0, 0.1, 0.3)
    fits = {air: solve(hold_parameters(problem, air), theta, noise) for air in ("isotropic", "all")}
    fit = fits["isotropic"]
    n = effective_sample_size(problem.predict(fit.mean).along, noise)
    likelihood = fits["isotropic"].chi2 - fits["all"].chi2
    difference = bic(problem, fits["all"]) - bic(hold_parameters(problem, "isotropic"), fit)
    assert 1.0 < n < len(problem.sniffs.ppm)
    assert difference == pytest.approx(4 * np.log(n) - likelihood, abs=3.0)  # but for the prior's part


def test_slower_eddies_are_fewer_readings(lab):
    problem, theta = beacon(lab, seed=5)
    along = problem.predict(theta).along
    counts = [effective_sample_size(along, Fluctuation(1.0, 0.1, t_s)) for t_s in (0.1, 1.0, 10.0, 1e6)]
    assert counts == sorted(counts, reverse=True) and counts[-1] >= 1.0


def test_an_unknown_air_is_refused(built):
    with pytest.raises(Exception, match=r"range_law.form is 'foggy', but it can be evidence.* or all. Type range_law.form=all") as refused:
        built("range_law", "range_law.form=foggy")
    assert isinstance(refused.value.__cause__, BadInput)
