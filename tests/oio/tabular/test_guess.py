"""Guesses on a table: codes for no measurement, times without marks, cells that are no numbers, places that are not known."""

import re

import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.tabular.guess import codes
from oio.tabular.mapping import open_mapping
from oio.tabular.positions import lost_places
from oio.tabular.read import read_mapped


@pytest.mark.parametrize(
    ("values", "found"),
    [([0, 420, 430, 425], {0.0: 1}), ([0, 0, 410, 2000, 600], {0.0: 2}), ([0, 1, 2, 30], {}), ([0, 0, 0], {}), ([5, 6, 7], {}),
     ([0, -5, 4], {}), ([-1, 420, 425], {-1.0: 1})],
)  # fmt: skip
def test_a_zero_far_below_everything_else_is_a_code(values, found):
    assert codes(np.array(values, dtype=float)) == found


def mapped(text, **given):
    """The table of a text by a mapping that is guessed but for what is given."""
    return read_mapped(text.encode(), open_mapping(**given), "my.csv")


def test_a_date_and_time_of_fourteen_digits_is_one():
    found = mapped("time,co2 [ppm]\n" + "".join(f"202503300140{i:02d},42{i}\n" for i in range(0, 10, 2)))
    assert found.mapping.time_unit == "%Y%m%d%H%M%S" and found.table.t_s.tolist() == [0, 2, 4, 6, 8]


@pytest.mark.parametrize("cell", ["0x01A6", "1'420.5", "many"])
def test_cells_that_are_no_numbers_are_shown(cell):
    """The time is no answer to the question for the readings."""
    rows = "".join(f"{i},{cell}\n" for i in range(5))
    with pytest.raises(BadInput, match=re.escape(f"'co2_ppm' (e.g. {cell!r}) is no number that is read here")):
        mapped(f"t_s,co2_ppm\n{rows}")
    with pytest.raises(BadInput, match=r"'t_s' of my\.csv stamps the rows, so it is no reading"):
        mapped(f"t_s,co2_ppm\n{rows}", columns=["t_s"])


HELD = np.concatenate([np.zeros(20), np.linspace(0.0, 0.3, 60), np.full(40, 0.3), np.linspace(0.3, 0.0, 60), np.zeros(20)])


@pytest.mark.parametrize(
    ("lost", "away_m", "found"),
    [([], 0.0, []), ([40], 0.3, [40]), ([60, 61, 62, 199], 0.3, [60, 61, 62, 199]), ([0, 100], 0.3, [0, 100])],
)
def test_a_place_of_zeros_is_unknown_where_the_nose_would_have_jumped(lost, away_m, found):
    """A gantry that is homed at the origin goes there as fast as it goes anywhere; a tracker that has lost its target jumps there."""
    t_s, p_m = 0.1 * np.arange(200), np.stack([HELD + away_m, HELD, HELD], axis=1)
    p_m[lost] = 0.0
    assert np.flatnonzero(lost_places(t_s, p_m)).tolist() == found
