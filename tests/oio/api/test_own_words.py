"""Advice of `locate` is for the reader of a log, who has no stage and no key of a run."""

import ast
from pathlib import Path

import pytest

from oio.api.location import own_words
from oio.inference import observability
from oio.results.criteria import consistency, judgement, search

KEYS = ("stage.", "stage=", "calibration=")


def texts(module):
    return [node.value for node in ast.walk(ast.parse(Path(module.__file__).read_text(encoding="utf-8"))) if isinstance(node, ast.Constant)]


SAID = [text for module in (consistency, judgement, search, observability) for text in texts(module) if isinstance(text, str)]


def test_there_is_advice_with_keys():
    assert sum(any(key in text for key in KEYS) for text in SAID) >= 7


@pytest.mark.parametrize("text", [text for text in SAID if any(key in text for key in KEYS)])
def test_no_key_of_a_run_is_left(text):
    said = own_words(text)
    assert not any(key in said for key in KEYS) and "()" not in said and "  " not in said.strip()


def test_a_nose_without_joints_is_not_told_to_use_more():
    advice = next(text for text in SAID if text.startswith("Use more joints (dof)"))
    assert own_words(advice) == advice and own_words(advice, by_hand=True).startswith("Sniff all around it")
    alone = "height cannot be found with dof=3: sniff nearer, and at more distances (stage.navigate.max_moves)."
    assert own_words(alone, by_hand=True) == "height cannot be found: sniff nearer, and at more distances."
