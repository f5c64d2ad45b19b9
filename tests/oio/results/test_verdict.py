"""PASS, WARN or FAIL from what a bench can see, the sentences that say why, and apart from them the score against the truth."""

from dataclasses import fields, replace

import pytest

from oio.core.errors import BadInput
from oio.inference.map_fit import CALIBRATED
from oio.inference.metrics import ResidualTest
from oio.results.summary import Outcome
from oio.results.verdict import Findings, Limits, judge, score

LIMITS = Limits(
    nees_fail=16.3, nis_low=0.5, nis_high=2.0, residuals_high=2.0, halves_high=16.3, baseline_effective=1.5, bound_ratio=4.0, narrowed=0.7,
)  # fmt: skip
FOUND = Findings(
    declared=True, moves=8, nis_mean=1.0, residuals=ResidualTest(0.9, 0.1), world=CALIBRATED, hypotheses=1, baseline_effective=3.0, dof=5,
    unseen=(),
)  # fmt: skip
GOOD = Outcome(0.01, None, 0.005, 3.0, True, 1.0, 8, 60.0, True, 0.05, (0.3, 0.0, 0.2), 0.015)


def test_a_good_run_passes_without_reasons():
    verdict = judge(FOUND, LIMITS)
    assert verdict.word == "PASS" and verdict.reasons == ()


def test_no_truth_enters_the_verdict():
    assert {field.name for field in fields(Findings)}.isdisjoint({"source_error_m", "nees_source", "inside_95", "bound_m", "outcome"})


@pytest.mark.parametrize(
    ("worse", "word", "says"),
    [
        ({"declared": False}, "WARN", "the position is unverified: the source was not declared within 8 moves. Raise"),
        ({"declared": False, "hypotheses": 2}, "WARN", "2 places are left"),
        ({"world": "another wind"}, "WARN", "the search saw another world than calibration: another wind"),
        ({"baseline_effective": 1.0}, "WARN", "1.0 effective independent readings"),
        ({"nis_mean": 0.3}, "WARN", "mean NIS is 0.30, from 0.5 on is consistent"),
        ({"nis_mean": 3.0}, "FAIL", "mean NIS is 3.00, up to 2 is consistent"),
        ({"residuals": ResidualTest(2.5, 0.0)}, "FAIL", "mean square 2.50"),
        ({"residuals": ResidualTest(0.9, 0.6)}, "FAIL", "autocorrelation 0.60, together 3.60"),
        ({"residuals": ResidualTest(0.9, 0.1, 20.0)}, "FAIL", "two halves of the search disagree on the source"),
    ],
)
def test_what_is_out_of_its_limit_is_named(worse, word, says):
    verdict = judge(replace(FOUND, **worse), LIMITS)
    assert verdict.word == word and len(verdict.reasons) == 1 and says in verdict.reasons[0]


def test_without_readings_nothing_is_consistent_or_inconsistent():
    assert judge(replace(FOUND, nis_mean=None, residuals=None), LIMITS).word == "PASS"


def test_what_the_motion_cannot_see_is_a_reason_at_every_dof():
    sentence = "distance and strength cannot be told apart"
    for dof in (1, 2, 3, 5):
        verdict = judge(replace(FOUND, dof=dof, unseen=(sentence,)), LIMITS)
        assert verdict.word == "WARN" and sentence in verdict.reasons
    assert len(judge(replace(FOUND, dof=1), LIMITS).reasons) == 1  # one joint alone is reason enough


def test_the_score_is_right_within_the_region_and_wrong_far_outside():
    assert score(GOOD, 0.008, 5, LIMITS).word == "RIGHT"
    near = score(replace(GOOD, nees_source=9.0, inside_95=False), 0.008, 5, LIMITS)
    assert near.word == "RIGHT" and "expected in one run of twenty" in near.reasons[0]
    far = score(replace(GOOD, nees_source=40.0, inside_95=False), 0.008, 5, LIMITS)
    assert far.word == "WRONG" and "the covariance is too small" in far.reasons[0]
    assert "5.0 times the Cramer-Rao bound" in score(replace(GOOD, source_error_m=0.04), 0.008, 5, LIMITS).reasons[0]


def test_without_a_truth_there_is_no_score():
    assert score(replace(GOOD, nees_source=None, inside_95=None), None, 5, LIMITS).word == "unknown"


@pytest.mark.parametrize(("dof", "ends"), [(1, "3.8"), (2, "6.0"), (3, "7.8")])
def test_the_region_of_a_bearing_is_smaller(dof, ends):
    scored = score(replace(GOOD, nees_source=9.0, inside_95=False), None, dof, LIMITS)
    assert f"the region ends at {ends}" in scored.reasons[0]


def test_a_share_above_one_is_refused():
    with pytest.raises(BadInput, match="narrowed is 2, but 0 to 1 is allowed"):
        replace(LIMITS, narrowed=2.0)
