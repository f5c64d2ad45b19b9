"""Rates of the shipped rules are those that their YAML states, on simulated noise and on a real sensor's clean air."""

import os
from pathlib import Path

import numpy as np
import pytest

from oio.gas.bout_rates import CleanAir, Rate, detections, false_alarms, simulated_false_alarms
from oio.gas.bouts import BoutRule

WHITE = CleanAir(sigma_ppm=2.0, tau_s=0.0, dt_s=0.5, elements=1)
DATA = Path(os.environ.get("OIO_DATA", "data"))
real = pytest.mark.skipif(not (DATA / "orebro3dsen").is_dir(), reason="no recordings here: OIO_DATA names no folder that has them")


@pytest.fixture(scope="module")
def rules(built):
    return {name: built("bout", f"bout={name}") for name in ("paper", "cusum")}


def test_the_false_alarms_are_those_that_the_yaml_states(rules):
    """2.8 % with the paper's rule at k = 11, 0.17 % with CUSUM: baselines of five readings, white noise."""
    paper, cusum = (simulated_false_alarms(rules[name], 11, WHITE, np.random.default_rng(0), trials=100) for name in ("paper", "cusum"))
    assert 0.014 < paper.value < 0.036
    assert 0.0005 < cusum.value < 0.003
    assert paper.trials == cusum.trials and cusum.interval[1] < paper.interval[0]


def test_a_step_of_three_sigma_is_found_as_often_as_the_yaml_states(rules):
    paper, cusum = (detections(rules[name], 11, WHITE, 6.0, 5, np.random.default_rng(1), trials=100) for name in ("paper", "cusum"))
    assert 0.35 < paper.value < 0.65 and cusum.value > 0.8


@pytest.mark.parametrize("name", ["paper", "cusum"])
def test_higher_steps_are_found_more_often_and_a_lag_delays_them(rules, name):
    def found(height_ppm, air=WHITE):
        return detections(rules[name], 5, air, height_ppm, 5, np.random.default_rng(2), trials=60).value

    assert found(0.0) < found(4.0) <= found(20.0)
    slow = CleanAir(sigma_ppm=2.0, tau_s=20.0, dt_s=0.5, elements=1)
    assert found(8.0, slow) < found(8.0)


def test_the_noise_is_as_described():
    lagged = CleanAir(sigma_ppm=3.0, tau_s=2.0, dt_s=0.5, elements=2).readings(20_000, np.random.default_rng(3))
    assert np.std(lagged) == pytest.approx(3.0, rel=0.05)
    assert np.corrcoef(lagged[1:, 0], lagged[:-1, 0])[0, 1] == pytest.approx(np.exp(-0.5), abs=0.02)
    assert abs(np.corrcoef(lagged.T)[0, 1]) < 0.05


def test_the_same_seed_gives_the_same_rate(rules):
    a, b = (simulated_false_alarms(rules["paper"], 3, WHITE, np.random.default_rng(4), trials=5) for _ in range(2))
    assert a == b


def test_wilsons_interval_of_none_is_not_never():
    assert Rate(0, 100).interval == (0.0, pytest.approx(0.037, abs=0.001)) and Rate(0, 100).value == 0.0


@real
def test_on_real_clean_air_a_common_threshold_alarms_on_the_noisy_sensor_and_one_of_its_own_does_not(built):
    """C_102 of Orebro3DSEN before the release: a threshold for the whole array, three times the median spread, is no threshold for it."""
    loaded = built("recording", "recording=orebro3dsen").load()
    clean = loaded.ppm[loaded.t_s < loaded.release_s]
    spread, noisy = np.std(clean, axis=0, ddof=1), clean[:, 11:12]
    rule = BoutRule(window_by_dof={3: 7}, differential="smoothed", threshold="mean_plus_3_sigma")
    own, common = (CleanAir(sigma, 0.0, 0.5, 1) for sigma in (spread[11], np.median(spread)))
    alarms = false_alarms(rule, 7, own, noisy, baseline=600)
    others = [false_alarms(rule, 7, common, clean[:, [i]], baseline=600).value for i in (6, 9, 15)]
    assert alarms.value < 0.03 and max(others) < 0.05
    above = np.mean(noisy[600:] - noisy[:600].mean() > 3.0 * np.median(spread))
    assert above > 5.0 * max(np.mean(clean[600:, i] - clean[:600, i].mean() > 3.0 * spread[i]) for i in (6, 9, 15))
