"""Guesses on a table of numbers: codes for no measurement."""

import numpy as np
import pytest

from oio.tabular.guess import codes


@pytest.mark.parametrize(
    ("values", "found"),
    [([0, 420, 430, 425], {0.0: 1}), ([0, 0, 410, 2000, 600], {0.0: 2}), ([0, 1, 2, 30], {}), ([0, 0, 0], {}), ([5, 6, 7], {}),
     ([0, -5, 4], {}), ([-1, 420, 425], {-1.0: 1})],
)  # fmt: skip
def test_a_zero_far_below_everything_else_is_a_code(values, found):
    assert codes(np.array(values, dtype=float)) == found
