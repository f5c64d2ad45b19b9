"""Approaches to a known source, counted from the way toward it to the way from it."""

from types import SimpleNamespace

import numpy as np
import pytest

from oio.gas.bout_rates import Rate
from oio.gas.exposures import exposures
from oio.gas.trace import Sniffs

ENDS_S = (0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0)
NEAR = (False, True, True, False, True, True)


class Above:
    """A rule that fires above a concentration, and says nothing of the first reading."""

    def __init__(self, ppm):
        self._ppm, self._begun = ppm, False

    def feed(self, reading):
        begun, self._begun = self._begun, True
        return SimpleNamespace(fired=reading.ppm > self._ppm) if begun else None


def sensed(ppm, times=None, element=None):
    """Readings every second, in the middle of it."""
    times = np.arange(len(ppm)) + 0.5 if times is None else np.array(times)
    n = len(times)
    element = np.zeros(n, dtype=int) if element is None else np.array(element)
    return Sniffs(times, np.zeros((n, 1)), np.arange(n), times, element, np.array(ppm, dtype=float), np.ones(n), np.zeros(n, dtype=bool))


def test_an_approach_counts_once_however_many_measurements_it_has():
    found = exposures(Above(5.0), sensed([9, 0, 0, 9, 0, 0, 9, 0, 0, 0, 0, 0]), ENDS_S, NEAR)
    assert (found.approaches, found.near, found.away) == (Rate(1, 2), Rate(1, 4), Rate(1, 2))


def test_a_rule_that_always_fires_finds_all_and_one_that_never_does_none():
    assert exposures(Above(-1.0), sensed([0.0] * 12), ENDS_S, NEAR).approaches == Rate(2, 2)
    never = exposures(Above(99.0), sensed([9.0] * 12), ENDS_S, NEAR)
    assert (never.approaches, never.near, never.away) == (Rate(0, 2), Rate(0, 4), Rate(0, 2))


def test_measurements_without_a_reading_are_left_out():
    """A slow sensor says nothing in a short dwell."""
    found = exposures(Above(5.0), sensed([9.0, 9.0, 9.0], times=[0.5, 2.5, 8.5]), ENDS_S, NEAR)
    assert (found.approaches, found.near, found.away) == (Rate(1, 1), Rate(2, 2), Rate(0, 1))


def test_without_a_measurement_there_is_no_approach():
    assert exposures(Above(5.0), sensed([9.0, 9.0]), (0.0,), ()).approaches == Rate(0, 0)
    with pytest.raises(ValueError, match="shorter"):
        exposures(Above(5.0), sensed([9.0, 9.0]), ENDS_S, NEAR[:2])
