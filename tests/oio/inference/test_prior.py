"""What Type B makes of what the beacon taught."""

from dataclasses import replace

import numpy as np
import pytest

from oio.gas.range_law import MAX_DISCREPANCY
from oio.inference.belief_map import search_problem
from oio.inference.map_fit import Fit
from oio.inference.prior import calibrated_prior, nominal_prior
from oio.inference.uncertainty import Noise


@pytest.fixture
def known(lab):
    made = lab(5, 2, seed=1)
    fit = Fit(made.layout, made.theta(), made.cov, 0.0, 0.0, made.model.fluctuation, 100, made.law)
    return lambda inflation: calibrated_prior(
        fit, made.arm, made.process_noise, made.nominal, replace(Noise.nominal(), inflation=inflation)
    )


def test_misses_inflate_all_that_a_reading_may_stray_by(known):
    plain, more = known(1.0), known(4.0)
    one, other = plain.model, more.model
    assert other.fluctuation.scale == pytest.approx(4.0 * one.fluctuation.scale)
    assert other.fluctuation.gamma == pytest.approx(2.0 * one.fluctuation.gamma)
    assert other.law.model_discrepancy == pytest.approx(2.0 * one.law.model_discrepancy) and other.law.nose_jitter_m == pytest.approx(
        2.0 * one.law.nose_jitter_m
    )
    rest = slice(4, None)  # the source itself is forgotten
    np.testing.assert_allclose(more.cov[rest, rest], 4.0 * plain.cov[rest, rest])


def test_misses_beyond_all_measure_are_no_crash(known):
    """A room that no law holds in, such as recordings of real gas."""
    assert known(1e7).model.law.model_discrepancy == MAX_DISCREPANCY


def test_a_strength_that_was_told_is_for_the_search_and_not_for_the_beacon(lab):
    made = lab(3, 1, seed=2)
    offsets, offsets_u = np.array([0.2]), np.array([0.02])
    told = replace(made.law, ln_strength=1.5, ln_strength_u=0.1)
    for a, b in zip(*(nominal_prior(made.arm, law, made.nominal, offsets, offsets_u) for law in (made.law, told)), strict=True):
        np.testing.assert_array_equal(a, b)
    sniffs = made.problem(made.theta()).sniffs
    asked, answered = (search_problem(sniffs, replace(made.known, model=replace(made.model, law=law))) for law in (made.law, told))
    assert (answered.mean[3], answered.cov[3, 3]) == (1.5, 0.1**2)
    assert (asked.mean[3], asked.cov[3, 3]) == (np.log(np.max(sniffs.ppm - made.mean[-1])), made.law.ln_strength_u**2)
    rest = np.arange(len(asked.mean)) != 3
    np.testing.assert_array_equal(answered.mean[rest], asked.mean[rest])
    np.testing.assert_array_equal(answered.cov[np.ix_(rest, rest)], asked.cov[np.ix_(rest, rest)])
