"""What may be answered: typed by a person, or held by a file."""

import pytest

from oio.core.errors import BadInput
from oio.procedure.answers import Choice, Done, Number, Text, YesNo

DEGC = Number(unit="degC", low=0, high=50)
ROUTE = Choice(options=("left", "right"))


@pytest.mark.parametrize(
    ("answer", "typed", "value"),
    [
        (Done(), "", "done"),
        (Text(), " SN 12 ", "SN 12"),
        (DEGC, "21.5", 21.5),
        (DEGC, "50", 50.0),
        (YesNo(), "y", True),
        (YesNo(), "No", False),
        (ROUTE, "left", "left"),
    ],
)
def test_what_is_typed_is_parsed_and_can_be_written_to_a_file(answer, typed, value):
    assert answer.parsed(typed) == value
    assert answer.checked(value) == value  # as a log gives it back


@pytest.mark.parametrize(
    ("answer", "typed"), [(Text(), " "), (DEGC, "warm"), (DEGC, "51"), (DEGC, "nan"), (DEGC, "-1"), (YesNo(), "perhaps"), (ROUTE, "up")]
)
def test_a_wrong_answer_is_refused_with_what_is_allowed(answer, typed):
    with pytest.raises(BadInput, match="was given, but ") as refused:
        answer.parsed(typed)
    assert answer.allowed in str(refused.value)


@pytest.mark.parametrize(
    ("answer", "value"),
    [
        (Done(), True),
        (Done(), ""),
        (Text(), 12),
        (Text(), None),
        (Text(), "a\nb"),
        (DEGC, "21"),
        (DEGC, True),
        (DEGC, None),
        (ROUTE, False),
    ],
)
def test_a_file_must_hold_the_right_type(answer, value):
    with pytest.raises(BadInput, match="is allowed"):
        answer.checked(value)


def test_a_choice_has_options():
    with pytest.raises(BadInput, match="two options"):
        Choice(options=("left",))
