"""Numbers are rounded by their uncertainty."""

import pytest

from oio.figures.rounding import rounded, with_uncertainty


@pytest.mark.parametrize(
    ("value", "u", "expected"),
    [
        (2.350096, 0.033899, ("2.350", "0.034")),
        (-0.0011020, 0.000254, ("-0.00110", "0.00025")),
        (7.1e-05, 0.0004, ("0.00007", "0.00040")),
        (-0.001, 0.43, ("0.00", "0.43")),
        (123.4, 99.6, ("123", "100")),
        (123.4, 17.2, ("123", "17")),
        (123456.0, 1800.0, ("123456", "1800")),
        (1.0, 1e-6, ("1", "1.0e-06")),
        (0.0, 0.0, ("0", "0")),
        (float("nan"), 0.1, ("nan", "0.1")),
    ],
)
def test_the_value_goes_as_far_as_its_uncertainty(value, u, expected):
    assert rounded(value, u) == expected


def test_both_stand_together():
    assert with_uncertainty(2.35, 0.034) == "2.350 \N{PLUS-MINUS SIGN}\N{NO-BREAK SPACE}0.034"
