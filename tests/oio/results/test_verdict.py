"""PASS, WARN or FAIL, and the sentences that say why."""

from dataclasses import replace

import pytest

from oio.core.errors import BadInput
from oio.results.summary import Outcome
from oio.results.verdict import Findings, Limits, judge

LIMITS = Limits(nees_fail=16.3, nis_low=0.5, nis_high=2.0, baseline_effective=1.5, bound_ratio=4.0, narrowed=0.7)
GOOD = Outcome(0.01, None, 0.005, 3.0, True, 1.0, 8, 60.0, True, 0.05, (0.3, 0.0, 0.2), 0.015)
FOUND = Findings(GOOD, bound_m=0.008, baseline_effective=3.0, dof=5, unseen=())


def test_a_good_run_passes_without_reasons():
    verdict = judge(FOUND, LIMITS)
    assert verdict.word == "PASS" and verdict.reasons == ()


@pytest.mark.parametrize(
    ("worse", "says"),
    [
        ({"nees_source": 9.0, "inside_95": False}, "the region ends at 7.8"),
        ({"found": False}, "was not declared within 8 moves"),
        ({"nis_mean": 3.0}, "mean NIS is 3.00"),
        ({"source_error_m": 0.04}, "5.0 times the Cramer-Rao bound"),
    ],
)
def test_what_is_out_of_its_limit_warns_and_is_named(worse, says):
    verdict = judge(replace(FOUND, outcome=replace(GOOD, **worse)), LIMITS)
    assert verdict.word == "WARN" and len(verdict.reasons) == 1 and says in verdict.reasons[0]


def test_a_truth_far_outside_the_covariance_fails():
    verdict = judge(replace(FOUND, outcome=replace(GOOD, nees_source=40.0, inside_95=False)), LIMITS)
    assert verdict.word == "FAIL" and "above 16.3 the covariance is too small" in verdict.reasons[0]


def test_what_the_motion_cannot_see_is_a_reason_at_every_dof():
    sentence = "distance and strength cannot be told apart"
    for dof in (1, 2, 3, 5):
        verdict = judge(replace(FOUND, dof=dof, unseen=(sentence,)), LIMITS)
        assert verdict.word == "WARN" and sentence in verdict.reasons
    assert len(judge(replace(FOUND, dof=1), LIMITS).reasons) == 1  # one joint alone is reason enough


@pytest.mark.parametrize(("dof", "ends"), [(1, "3.8"), (2, "6.0"), (3, "7.8")])
def test_the_region_of_a_bearing_is_smaller(dof, ends):
    verdict = judge(replace(FOUND, dof=dof, outcome=replace(GOOD, nees_source=9.0, inside_95=False)), LIMITS)
    assert f"the region ends at {ends}" in verdict.reasons[0]


def test_a_share_above_one_is_refused():
    with pytest.raises(BadInput, match="narrowed is 2, but 0 to 1 is allowed"):
        replace(LIMITS, narrowed=2.0)
