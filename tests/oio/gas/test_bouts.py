"""Eq. (1) by hand, both readings of every hole, and how often the paper's rule fires on nothing."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.core.errors import BadInput
from oio.core.records import GasReading
from oio.gas.bouts import BoutDetector, BoutRule, ElementBaseline, effective_samples, element_baseline

CLEAN = ElementBaseline(ppm=10.0, sigma_ppm=1.0, highest_ppm=11.0, n=5, n_effective=5.0)


def rule(differential="smoothed", threshold="max", windows=None):
    return BoutRule(window_by_dof=windows or {1: 3, 2: 5, 3: 7, 5: 11}, differential=differential, threshold=threshold)


def fed(values, k=2, baselines=(CLEAN,), **choices):
    detector = BoutDetector(rule(**choices), k, baselines)
    return [detector.feed(GasReading(i, i % len(baselines), v, 1.0)) for i, v in enumerate(values)]


def test_equation_1_by_hand():
    """y = 0 0 2 6 6; y' = - 0 1 4 6; d = y'_t - y'_{t-1} = - - 1 3 2; a bout where d grows and y' is above 1."""
    steps = fed([10.0, 10.0, 12.0, 16.0, 16.0])
    assert steps[:2] == [None, None]
    assert [s.smoothed_ppm for s in steps[2:]] == [1.0, 4.0, 6.0]
    assert [s.delta_ppm for s in steps[2:]] == [1.0, 3.0, 2.0]
    assert [s.fired for s in steps[2:]] == [False, True, False]
    assert steps[3].spread_ppm == pytest.approx(np.std([2.0, 6.0], ddof=1))


@pytest.mark.parametrize("differential", ["smoothed", "raw"])
@given(st.lists(st.floats(20, 1000), min_size=5, max_size=5))
def test_the_first_window_has_no_differential_and_the_first_differential_none_to_exceed(differential, values):
    """Eq. (1) needs y'_{t-1}, the rule delta_{t-1} as well; a sensor that is in gas from the start rose from nothing."""
    steps = fed(values, k=3, differential=differential)
    assert steps[:3] == [None, None, None]
    assert steps[3].delta_ppm == pytest.approx((np.mean(values[1:4]) if differential == "smoothed" else values[3]) - 10.0
                                               - (np.mean(values[:3]) - 10.0))  # fmt: skip
    assert not steps[3].fired and steps[4].fired == (steps[4].delta_ppm > steps[3].delta_ppm)


def test_the_raw_differential_takes_the_reading_itself():
    """d = y_t - y'_{t-1}: 2 - 0, 6 - 1, 6 - 4."""
    assert [s.delta_ppm for s in fed([10.0, 10.0, 12.0, 16.0, 16.0], differential="raw")[2:]] == [2.0, 5.0, 2.0]


def test_max_and_three_sigma_are_different_thresholds():
    rising = [10.0, 10.0, 12.5, 13.5]  # y' = 0, 1.25, 3.0 (not above 3); d = 1.25, 1.75
    assert [s.fired for s in fed(rising)[2:]] == [False, True]
    assert [s.fired for s in fed(rising, threshold="mean_plus_3_sigma")[2:]] == [False, False]
    assert fed([10.0, 10.0, 12.5, 13.6], threshold="mean_plus_3_sigma")[-1].fired


def test_each_element_has_its_own_offset():
    other = ElementBaseline(ppm=50.0, sigma_ppm=1.0, highest_ppm=51.0, n=5, n_effective=5.0)
    steps = fed([10.0, 50.0, 12.0, 54.0], k=2, baselines=(CLEAN, other))
    assert steps[:3] == [None, None, None]  # the second element is not known, then the window is not full, then there is no y'_{t-1}
    assert (steps[3].smoothed_ppm, steps[3].delta_ppm) == (2.0, 1.5)  # y = 0, 1, 3; y' = 0.5, 2
    assert not any(s.fired for s in fed([10.0, 50.0] * 20, baselines=(CLEAN, other)) if s)


@given(st.lists(st.floats(0, 100), min_size=6, max_size=30), st.floats(-50, 50))
def test_an_offset_of_sensor_and_baseline_changes_nothing(values, offset):
    moved = ElementBaseline(10.0 + offset, 1.0, 11.0 + offset, 5, 5.0)
    here, there = fed(values, k=3), fed([v + offset for v in values], k=3, baselines=(moved,))
    for a, b in zip(here[3:], there[3:], strict=True):
        assert a.smoothed_ppm == pytest.approx(b.smoothed_ppm, abs=1e-9)
        assert a.delta_ppm == pytest.approx(b.delta_ppm, abs=1e-9)


@pytest.mark.parametrize("k", [3, 5, 7, 11])
def test_on_noise_the_papers_rule_fires_a_quarter_of_the_time_above_the_mean(k):
    rng = np.random.default_rng(k)
    mean = ElementBaseline(0.0, 1.0, 0.0, 5, 5.0)  # its highest reading is its mean: the rule against the mean
    fired = np.mean([s.fired for s in fed(rng.standard_normal(8000), k=k, baselines=(mean,)) if s])
    assert 0.21 < fired < 0.29


def test_against_the_highest_reading_it_fires_seldom():
    rng, rates = np.random.default_rng(0), []
    for _ in range(60):
        y = rng.standard_normal(5)
        clean = ElementBaseline(float(np.mean(y)), 1.0, float(np.max(y)), 5, 5.0)
        rates.append(np.mean([s.fired for s in fed(rng.standard_normal(200), k=5, baselines=(clean,)) if s]))
    assert 0.005 < np.mean(rates) < 0.08


def test_correlated_readings_are_worth_less():
    assert effective_samples(5, 0.5, 6.0) == pytest.approx(1.14, abs=0.005)
    assert effective_samples(5, 1e6, 1.0) == pytest.approx(5.0)
    assert effective_samples(1, 0.5, 6.0) == 1.0


@given(st.integers(2, 50), st.floats(0.01, 10), st.floats(0.01, 100))
def test_readings_are_worth_between_one_and_their_number(n, dt_s, tau_s):
    worth = effective_samples(n, dt_s, tau_s)
    assert 1.0 - 1e-9 <= worth <= n + 1e-9
    assert effective_samples(n, 2 * dt_s, tau_s) >= worth - 1e-9


def test_effective_number_is_the_variance_of_a_mean():
    """Against simulation of a lagged white input."""
    rng, rho, n = np.random.default_rng(0), np.exp(-0.5 / 2.0), 5
    y = np.zeros((20_000, n))
    y[:, 0] = rng.standard_normal(len(y))
    for j in range(1, n):
        y[:, j] = rho * y[:, j - 1] + np.sqrt(1 - rho**2) * rng.standard_normal(len(y))
    assert 1.0 / np.var(y.mean(axis=1)) == pytest.approx(effective_samples(n, 0.5, 2.0), rel=0.05)


def test_baseline_of_five_readings():
    ppm = np.array([10.0, 12.0, 11.0, 9.0, 13.0])
    b = element_baseline(ppm, dt_s=1e6, tau_s=1.0, nominal_sigma_ppm=0.1)
    assert (b.ppm, b.highest_ppm, b.n) == (11.0, 13.0, 5)
    assert b.sigma_ppm == pytest.approx(np.std(ppm, ddof=1))
    assert b.u_ppm == pytest.approx(b.sigma_ppm / np.sqrt(5))


def test_five_readings_on_one_count_are_luck_not_silence():
    b = element_baseline(np.full(5, 7.0), dt_s=1.0, tau_s=1.0, nominal_sigma_ppm=2.0)
    assert b.sigma_ppm == 1.0 and b.n_effective == pytest.approx(5.0)  # white noise of the electronics is not lagged


@pytest.mark.parametrize(
    ("choices", "said"),
    [
        ({"differential": "central"}, "bout.differential is 'central', but it can be smoothed or raw"),
        ({"threshold": "cusum"}, "Type bout=cusum"),
        ({"threshold": "mean"}, "bout.threshold is 'mean', but it can be max or mean_plus_3_sigma"),
        ({"windows": {1: 1}}, "window_by_dof.1 is 1, but 2 to 10000 is allowed"),
    ],
)
def test_other_readings_of_the_paper_are_refused(choices, said):
    with pytest.raises(BadInput, match=said):
        rule(**choices)


def test_a_rung_without_a_window_has_that_of_the_papers_rule():
    assert [rule().window(dof) for dof in (1, 2, 3, 4, 5, 6, 7)] == [3, 5, 7, 9, 11, 13, 15]
