"""Limits of a criterion, their words, and wrong ones."""

import math

import pytest

from oio.core.errors import BadInput
from oio.core.settings import settings
from oio.results.criteria.judgement import Criterion, Measured


@settings
class Given(Criterion):
    value: float

    def measure(self, results):
        return Measured(self.value, "mm", "it is so", "too low", "too high")


@pytest.mark.parametrize(
    ("value", "word", "action"),
    [(1, "PASS", ""), (2, "PASS", ""), (0.9, "WARN", "too low"), (0.5, "WARN", "too low"), (0.4, "FAIL", "too low"),
     (3, "WARN", "too high"), (3.1, "FAIL", "too high")],
)  # fmt: skip
def test_limits_belong_to_the_better_word(value, word, action):
    found = Given(passes=(1, 2), warns=(0.5, 3), value=value).judge("x", {})
    assert (found.word, found.action, found.allowed) == (word, action, "1 to 2 mm")


def test_an_open_end_allows_everything_there():
    assert Given(passes=(None, 2), warns=(None, 3), value=-1e9).judge("x", {}).word == "PASS"
    assert Given(passes=(1, None), warns=(0, None), value=1e9).judge("x", {}).allowed == "at least 1 mm"
    assert Given(passes=(None, 2), warns=(None, None), value=1e9).judge("x", {}).word == "WARN"
    assert Given(passes=(None, None), warns=(None, None), value=0).judge("x", {}).allowed == "anything"


def test_what_is_not_a_number_fails():
    object.__setattr__(given := Given(passes=(0, 2), warns=(0, 3), value=1), "value", math.nan)
    assert given.judge("x", {}).word == "FAIL"


def test_the_reason_has_number_limit_and_action():
    assert Given(passes=(1, 2), warns=(1, 2), value=9).judge("size", {}).reason == "size: it is so (1 to 2 mm). too high"


@pytest.mark.parametrize(("passes", "warns"), [((1, 2), (1.5, 3)), ((1, 2), (0, 1.5)), ((None, 2), (0, 3)), ((1, None), (0, 5))])
def test_limits_of_a_warning_hold_those_of_a_pass(passes, warns):
    with pytest.raises(BadInput, match="warns must hold all of passes"):
        Given(passes=passes, warns=warns, value=1)
