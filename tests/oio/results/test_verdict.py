"""The score against the truth, which stands apart from the verdict."""

from dataclasses import replace

import pytest
from scipy.stats import chi2

from oio.results.evaluation import Outcome
from oio.results.verdict import ScoreLimits, rarity, score

LIMITS = ScoreLimits(nees=16.3, bound_ratio=4.0, nowhere=0.15)
BOX_SD_M = 0.33
GOOD = Outcome(0.01, None, 0.005, 3.0, True, 1.0, 8, 60.0, True, 0.05, (0.3, 0.0, 0.2), 0.015)


def test_the_score_is_right_within_the_region_and_wrong_far_outside():
    assert score(GOOD, 0.008, 5, LIMITS, BOX_SD_M).word == "RIGHT"
    near = score(replace(GOOD, nees_source=9.0, inside_95=False), 0.008, 5, LIMITS, BOX_SD_M)
    assert near.word == "RIGHT" and "chance does that in one run of 34" in near.reasons[0]
    far = score(replace(GOOD, nees_source=40.0, inside_95=False), 0.008, 5, LIMITS, BOX_SD_M)
    assert far.word == "WRONG" and "the covariance is too small" in far.reasons[0]
    assert "5.0 times the Cramer-Rao bound" in score(replace(GOOD, source_error_m=0.04), 0.008, 5, LIMITS, BOX_SD_M).reasons[0]


def test_without_a_truth_there_is_no_score():
    assert score(replace(GOOD, nees_source=None, inside_95=None), None, 5, LIMITS, BOX_SD_M).word == "unknown"


def test_a_region_as_large_as_the_room_is_neither_right_nor_wrong():
    nowhere = score(replace(GOOD, source_error_m=1.8, sd_m=2.3), 0.008, 5, LIMITS, BOX_SD_M)
    assert nowhere.word == "unknown" and "too large" in nowhere.reasons[0]
    assert score(replace(GOOD, sd_m=2.3), 0.008, 2, LIMITS, BOX_SD_M).word == "RIGHT"  # of a bearing no place is asked


@pytest.mark.parametrize(("dof", "ends"), [(1, "3.8"), (2, "6.0"), (3, "7.8")])
def test_the_region_of_a_bearing_is_smaller(dof, ends):
    scored = score(replace(GOOD, nees_source=9.0, inside_95=False), None, dof, LIMITS, BOX_SD_M)
    assert f"the region ends at {ends}" in scored.reasons[0]


@pytest.mark.parametrize("dof", [1, 2, 3])
def test_the_rarity_is_that_of_chi_square(dof):
    for nees in (0.0, 0.3, 3.84, 7.81, 16.3):
        assert rarity(nees, dof) == pytest.approx(chi2.sf(nees, dof), rel=1e-12)
