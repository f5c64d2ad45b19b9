"""CUSUM: by hand, its false alarms as often as asked for, its steps those of the smoothed signal."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.core.errors import BadInput
from oio.core.records import GasReading
from oio.gas.bouts import BoutRule, ElementBaseline
from oio.gas.cusum import CusumRule, decision_interval, run_length
from oio.gas.detection_rule import DetectionRule

KNOWN = ElementBaseline(ppm=10.0, sigma_ppm=1.0, highest_ppm=11.0, n=10**6, n_effective=1e12)
WINDOWS = {1: 3, 2: 5, 3: 7, 5: 11}


def rule(reference=1.0, rate=1e-3, windows=None):
    return CusumRule(window_by_dof=windows or WINDOWS, reference_sigmas=reference, false_alarm_rate=rate)


def fed(values, k=2, baselines=(KNOWN,), chosen=None):
    detector = (chosen or rule()).detector(k, baselines)
    return [detector.feed(GasReading(i, i % len(baselines), v, 1.0)) for i, v in enumerate(values)]


def test_the_sum_by_hand():
    """Reference 1, decision 2.64: readings of 2.5 sigma add 1.5 each, so that every second one is a bout, and the sum begins anew."""
    assert rule().decision_sigmas == pytest.approx(2.637, abs=0.001)
    steps = fed([10.0] * 4 + [12.5] * 6)
    assert [s.fired for s in steps[2:]] == [False, False, False, True, False, True, False, True]


@given(st.lists(st.floats(0, 30), min_size=6, max_size=40), st.floats(-50, 50), st.floats(0.01, 100))
def test_neither_offset_nor_unit_matters(values, offset, unit):
    moved = ElementBaseline(unit * (10.0 + offset), unit, unit * (11.0 + offset), 10**6, 1e12)
    detector = rule().detector(3, (moved,))
    there = [detector.feed(GasReading(i, 0, unit * (round(v, 3) + offset), unit)) for i, v in enumerate(values)]
    assert sum(s.fired for s in there if s) == pytest.approx(sum(s.fired for s in fed([round(v, 3) for v in values], k=3) if s), abs=1)


@given(st.lists(st.floats(0, 100), min_size=6, max_size=30))
def test_signal_differential_and_spread_are_those_of_the_papers_rule(values):
    paper = BoutRule(window_by_dof=WINDOWS, differential="smoothed", threshold="max")
    for a, b in zip(fed(values, k=3), fed(values, k=3, chosen=paper), strict=True):
        assert (a is None) == (b is None)
        assert a is None or (a.smoothed_ppm, a.delta_ppm, a.spread_ppm) == (b.smoothed_ppm, b.delta_ppm, b.spread_ppm)


@pytest.mark.parametrize(("reference", "rate"), [(0.5, 0.01), (1.0, 0.01), (1.0, 1e-3)])
def test_about_a_known_baseline_it_fires_as_often_as_asked_for(reference, rate):
    noise = 10.0 + np.random.default_rng(0).standard_normal(20_000)
    fired = np.mean([s.fired for s in fed(noise, chosen=rule(reference, rate)) if s])
    assert 0.5 * rate < fired < 1.6 * rate


def test_each_element_has_a_sum_of_its_own():
    """A rise of the second element alone is found, though the mean over both hardly rises above the threshold."""
    steps = fed([10.0, 10.0] * 4 + [10.0, 13.0] * 3, baselines=(KNOWN, KNOWN))
    assert [i for i, s in enumerate(steps) if s and s.fired] == [11]


@given(st.floats(0.1, 3.0), st.floats(10.0, 1e6))
def test_the_decision_interval_has_the_run_length(reference, readings):
    decision = decision_interval(reference, readings)
    assert decision == 0.0 or run_length(reference, decision) == pytest.approx(readings, rel=1e-6)


def test_it_is_a_rule_and_bad_settings_are_refused():
    assert isinstance(rule(), DetectionRule) and rule().window(5) == 11 and rule().window(4) == 9
    for bad, said in (
        (lambda: rule(windows={1: 1}), "window_by_dof.1 is 1, but 2 to"),
        (lambda: rule(rate=0.5), "false_alarm_rate"),
    ):
        with pytest.raises(BadInput, match=said):
            bad()
