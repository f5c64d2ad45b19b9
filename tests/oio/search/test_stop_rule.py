"""A source is declared when every condition holds, and not when any one is at its edge or over it."""

from dataclasses import replace

import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.core.records import Belief
from oio.estimators.odometry import Odometry
from oio.inference.map_fit import Fit
from oio.inference.metrics import ResidualTest
from oio.search.stop_rule import StopRule
from oio.search.view import Move

RULE = StopRule(sd_m=0.012, sniff_radius_m=0.08, min_sniffs=3, max_nis=3.0, max_halves=16.3)
LESS, MORE = 1.0 - 1e-9, 1.0 + 1e-9


class Search:
    """A search at its end: the source is believed `away_m` from the noses of its moves, which all but one are bouts."""

    def __init__(self, made, built, sd_m=0.006, away_m=0.05, offset_rad=0.0):
        self.made, at = made, made.model.at
        self.odometry = Odometry(built("ekf"), made.known, built("belief_map"))
        mean, cov = np.zeros(made.model.size), np.eye(made.model.size)
        mean[at["o"]] = offset_rad
        mean[at["s"]] = made.arm.nose(made.arm.home - mean[at["o"]]) + np.array([0.0, 0.0, away_m])
        cov[at["s"], at["s"]] = sd_m**2 / 3.0 * np.eye(3)
        self.odometry.belief, self.odometry.hypotheses = Belief(0, mean, cov), (self.fit,)
        self.told([1.0] * 10)

    @property
    def fit(self):
        return Fit(self.made.layout, self.made.mean, self.made.cov, 0.0, 0.0, self.made.model.fluctuation, 1, self.made.law)

    def told(self, nis):
        self.odometry._nis = list(nis)

    def moves(self, smelt, not_smelt=1):
        q = self.made.arm.home
        return (*[Move(q, 0.2, 7.0)] * smelt, *[Move(q, 0.0, 7.0)] * not_smelt)

    def may_declare(self, smelt=3, rule=RULE):
        return rule.may_declare(self.odometry, self.moves(smelt))


@pytest.fixture
def search(lab, built):
    made = lab(3)
    return lambda **how: Search(made, built, **how)


def test_it_holds_when_everything_does(search):
    assert search().may_declare() is True


def test_before_the_first_map_there_is_nothing_to_declare(search):
    begun = search()
    begun.odometry.belief, begun.odometry.hypotheses = None, ()
    assert begun.may_declare() is False


@pytest.mark.parametrize(("share", "declared"), [(LESS, True), (MORE, False)])
def test_the_spread_is_the_root_of_the_trace(search, share, declared):
    """0.012 m in all, 0.0069 m along each axis."""
    assert search(sd_m=share * RULE.sd_m).may_declare() is declared


def test_one_wide_axis_is_enough_to_go_on(search):
    wide = search()
    cov, s = np.array(wide.odometry.belief.cov), wide.made.model.at["s"]
    cov[s, s] = np.diag([1e-8, 1e-8, RULE.sd_m**2])
    wide.odometry.belief = replace(wide.odometry.belief, cov=cov)
    assert wide.may_declare() is False


@pytest.mark.parametrize("offset_rad", [0.0, 0.1])
@pytest.mark.parametrize(("share", "declared"), [(LESS, True), (MORE, False)])
def test_near_is_measured_from_where_the_nose_is_believed_to_have_been(search, share, declared, offset_rad):
    """Encoders that are off by 0.1 rad are off by some centimetres: the believed offset is taken away."""
    assert search(away_m=share * RULE.sniff_radius_m, offset_rad=offset_rad).may_declare() is declared


@pytest.mark.parametrize(("smelt", "declared"), [(0, False), (2, False), (3, True), (4, True)])
def test_only_sniffs_with_bouts_count(search, smelt, declared):
    """One more move was as near, without a bout."""
    assert search().may_declare(smelt) is declared


def test_sniffs_from_afar_do_not_count(search):
    there = search()
    far = there.made.arm.home + np.array([1.0, 0.0, 0.0])
    assert RULE.may_declare(there.odometry, (*there.moves(2), Move(far, 1.0, 7.0))) is False


@pytest.mark.parametrize(("hypotheses", "declared"), [(1, True), (2, False), (3, False)])
def test_one_hypothesis_is_left(search, hypotheses, declared):
    left = search()
    left.odometry.hypotheses = (left.fit,) * hypotheses
    assert left.may_declare() is declared


@pytest.mark.parametrize(
    ("nis", "declared"),
    [
        ([LESS * RULE.max_nis] * 10, True),
        ([RULE.max_nis] * 10, False),  # below it, not at it
        ([MORE * RULE.max_nis] * 10, False),
        ([0.0] * 9 + [LESS * 10 * RULE.max_nis], True),  # the mean counts
        ([0.0] * 9 + [MORE * 10 * RULE.max_nis], False),
        ([0.5] * 9, False),  # too few to speak for the filter: before, a map emptied the innovations and anything was declared
        ([], False),
    ],
)
def test_a_surprised_filter_declares_nothing(search, nis, declared):
    surprised = search()
    surprised.told(nis)
    assert surprised.may_declare() is declared


@pytest.mark.parametrize(("halves", "declared"), [(0.0, True), (LESS * RULE.max_halves, True), (RULE.max_halves, False)])
def test_halves_that_disagree_declare_nothing(search, halves, declared):
    split = search()
    split.odometry.hypotheses = (replace(split.fit, residuals=ResidualTest(1.0, 0.0, halves)),)
    assert split.may_declare() is declared


@pytest.mark.parametrize("change", [{"sd_m": 0.006 * LESS}, {"sniff_radius_m": 0.05 * LESS}, {"min_sniffs": 4}, {"max_nis": 1.0}])
def test_every_condition_alone_can_forbid(search, change):
    """What is declared by the rule is not by one that is a little stricter anywhere (NIS may be 1 at least)."""
    assert search().may_declare(rule=replace(RULE, **change)) is False


@pytest.mark.parametrize(
    ("key", "lowest", "highest"),
    [("sd_m", 1e-5, 1.0), ("sniff_radius_m", 1e-3, 10.0), ("min_sniffs", 1, 1000), ("max_nis", 1.0, 1e6), ("max_halves", 1.0, 1e6)],
)
def test_senseless_rules_are_refused(key, lowest, highest):
    for value in (lowest, highest):
        assert getattr(replace(RULE, **{key: value}), key) == value
    for value in (0 if key == "min_sniffs" else lowest * LESS, highest + 1):
        with pytest.raises(BadInput, match=f"StopRule.{key} is .*, but .* is allowed"):
            replace(RULE, **{key: value})
