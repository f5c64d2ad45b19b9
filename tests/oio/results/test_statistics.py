"""Intervals of proportions, against scipy.stats."""

import pytest
from scipy.stats import binomtest

from oio.results.statistics import at_least


@pytest.mark.parametrize(("successes", "trials"), [(1, 1), (1, 9), (2, 9), (10, 500), (500, 500)])
def test_at_least_is_the_exact_one_sided_limit(successes, trials):
    expected = binomtest(successes, trials, alternative="greater").proportion_ci(0.95, "exact").low
    assert at_least(successes, trials) == pytest.approx(expected, rel=1e-9)


def test_no_success_is_at_least_nothing():
    assert at_least(0, 9) == 0.0
