"""Every sensor with every profile keeps its promises; laws at points of their sheets; lag, noise, wandering and taking turns."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oio.core.errors import BadInput
from oio.core.records import GasSample
from oio.testing import check_sensor

CONF = Path(__file__).resolve().parents[3] / "conf"
SENSORS = sorted(path.stem for path in (CONF / "sensor").glob("*.yaml"))
PROFILES = sorted(path.stem for path in (CONF / "profile").glob("*.yaml"))
EXACT = {"gain": 0.0, "bias": 0.0, "tau": 0.0, "drift_per_sqrt_h": 0.0, "warm_up": 0.0, "noise": 0.0, "per_degc": 0.0, "per_pct_rh": 0.0}


def exact(sensor, **changes):
    """The same sensor without spread, noise and drift."""
    return replace(sensor, spread=replace(sensor.spread, **{**EXACT, **changes}))


def unit(sensor, truth=1, noise=2):
    return sensor.unit(np.random.default_rng(truth), np.random.default_rng(noise))


def reads(sensor, raw, element=0):
    return sensor.reading(GasSample(0, element, raw)).ppm


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("name", SENSORS)
def test_every_sensor_keeps_its_promises(built, name, profile):
    check_sensor(built("sensor", f"sensor={name}", f"profile={profile}"))


@pytest.mark.parametrize("name", SENSORS)
@given(ppm=st.floats(0.0, 500.0))
def test_raw_to_ppm_and_back(built, name, ppm):
    sensor = built("sensor", f"sensor={name}")
    assert reads(sensor, sensor.raw(ppm)) == pytest.approx(ppm, rel=1e-9, abs=1e-9)
    assert sensor.raw(ppm + 1.0) > sensor.raw(ppm)


@pytest.mark.parametrize("name", SENSORS)
@given(ppm=st.floats(1.0, 500.0))
def test_what_a_perfect_unit_puts_on_the_wire_is_within_half_a_step(built, name, ppm):
    sensor = exact(built("sensor", f"sensor={name}"))
    raw = sensor.electronics(ppm, 1.0, 0.0)
    one = 1.0 if name not in ("ndir", "pa") else sensor.step_ppm
    assert raw == pytest.approx(round(raw / one) * one, abs=1e-9)
    assert abs(raw - sensor.raw(ppm)) <= one / 2 + 1e-9


@pytest.mark.parametrize("name", SENSORS)
def test_sigma_is_the_scatter_of_a_units_readings(built, name):
    """With gain 1: what `sigma_ppm` says at 50 ppm is what readings do there."""
    sensor = built("sensor", f"sensor={name}")
    noisy = exact(sensor, noise=sensor.spread.noise)
    u = unit(noisy)
    u.step(50.0, 1.0)
    t_s, ppm = 0.0, []
    for _ in range(3000):
        t_s += sensor.dynamics.update_s
        ppm.append(reads(noisy, u.sample(0, t_s)))
    assert np.std(ppm) == pytest.approx(noisy.sigma_ppm(50.0), rel=0.06)


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("name", SENSORS)
def test_one_lag_after_a_step_it_is_63_percent_there(built, name, profile):
    sensor = exact(built("sensor", f"sensor={name}", f"profile={profile}"))
    d, u, t_s = sensor.dynamics, unit(sensor), 0.0
    levels = {}
    for key, ppm, wait_s in (
        ("low", 100.0, 1.0),
        ("rise", 400.0, d.tau_rise_s),
        ("high", 400.0, 30 * d.tau_rise_s),
        ("fall", 100.0, d.tau_fall_s),
    ):
        for _ in range(50):  # the answer does not hang on the step
            u.step(ppm, wait_s / 50)
        t_s += max(wait_s, d.update_s)
        levels[key] = reads(sensor, u.sample(0, t_s))
    assert levels["low"] == pytest.approx(100.0, rel=0.01) and levels["high"] == pytest.approx(400.0, rel=0.01)
    assert levels["rise"] == pytest.approx(400.0 - 300.0 * math.exp(-1), rel=0.01)
    assert levels["fall"] == pytest.approx(100.0 + 300.0 * math.exp(-1), rel=0.01)


def test_a_value_is_held_until_the_update_time_has_passed(built):
    sensor = built("sensor", "sensor=ndir", "profile=datasheet")
    u = unit(sensor)
    u.step(420.0, 1.0)
    first = u.sample(0, 2.0)
    u.step(900.0, 100.0)
    assert u.sample(0, 3.9) == first != u.sample(0, 4.0)


def test_twin_elements_differ_but_share_their_lag(built):
    sensor = built("sensor", "sensor=mox_mq")
    u = unit(replace(sensor, spread=replace(sensor.spread, noise=0.0, drift_per_sqrt_h=0.0)))
    u.step(50.0, 1.0)
    a, b = (reads(sensor, u.sample(e, 1.0), e) for e in (0, 1))
    assert abs(math.log((a + sensor.air_ppm) / (b + sensor.air_ppm))) > 0.05


def test_specimens_spread_as_the_yaml_says(built):
    sensor = exact(built("sensor", "sensor=ec"), gain=0.1, bias=1.0)
    rises, offsets = [], []
    for seed in range(400):
        u = unit(sensor, truth=seed)
        u.step(100.0, 1.0)
        high = reads(sensor, u.sample(0, 1.0))
        u.step(0.0, 1e4)
        offsets.append(reads(sensor, u.sample(0, 2e4)))
        rises.append(math.log((high - offsets[-1]) / 100.0))
    assert np.std(rises) == pytest.approx(0.1, rel=0.15) and np.mean(rises) == pytest.approx(0.0, abs=0.02)
    assert np.std(offsets) == pytest.approx(1.0, rel=0.15)


def test_the_warm_up_tail_decays_and_the_baseline_wanders(built):
    sensor = exact(built("sensor", "sensor=pa"), warm_up=230.0)
    cold = replace(sensor, dynamics=replace(sensor.dynamics, powered_for_s=0.0))
    u = unit(cold)
    u.step(420.0, 1e-6)
    start = reads(cold, u.sample(0, 0.0))
    u.step(420.0, 130.0)
    assert start == pytest.approx(650.0, abs=1.0) and reads(cold, u.sample(0, 130.0)) == pytest.approx(420.0 + 230.0 / math.e, abs=2.0)
    wandering, ends = exact(sensor, drift_per_sqrt_h=20.0), []
    for seed in range(300):
        u = unit(wandering, noise=seed)
        for _ in range(4):
            u.step(420.0, 900.0)
        ends.append(reads(wandering, u.sample(0, 3600.0)))
    assert np.std(ends) == pytest.approx(20.0, rel=0.15)  # after an hour


def test_the_metal_oxide_law_at_points_of_the_sheets(built):
    """MQ-3: Rs/R0 = 60 in clean air; MiCS-5524: Rs = R0 there; counts by the divider."""
    mq, mics = built("sensor", "sensor=mox_mq"), built("sensor", "sensor=mox_mics")
    for sensor, ratio in ((mq, 60.0), (mics, 1.0)):
        counts, full = sensor.raw(0.0), 2**sensor.adc_bits - 1
        resistance = sensor.load_ohm * (full / counts - 1.0)
        assert resistance / sensor.r0_ohm == pytest.approx(ratio, rel=0.01)
    ten, hundred = ((2**16 - 1) / mics.raw(c - mics.air_ppm) - 1.0 for c in (10.0, 100.0))
    assert ten / hundred == pytest.approx(10.0**mics.law_b)  # a straight line on the sheet's log-log paper


def test_the_electrochemical_law_by_hand(built):
    """525 nA/ppm through 3500 Ohm is 1.8375 mV/ppm; zero is 20 % of 2.5 V."""
    ec = built("sensor", "sensor=ec")
    assert ec.raw(0.0) == pytest.approx(0.2 * 65535)
    assert (ec.raw(100.0) - ec.raw(0.0)) * 2.5 / 65535 == pytest.approx(0.18375)
    assert ec.electronics(1e6, 1.0, 0.0) == 65535 and ec.electronics(-1e6, 1.0, 0.0) == 0  # clipped at the rails


def test_optical_sensors_put_rounded_ppm_on_the_wire(built):
    assert built("sensor", "sensor=pa").electronics(420.4, 1.0, 0.0) == 420.0
    assert built("sensor", "sensor=ndir").electronics(420.44, 1.0, 0.0) == pytest.approx(420.4)
    assert built("sensor", "sensor=ndir").electronics(10.0, 1.0, -50.0) == 0.0


def test_temperature_swings_the_signal(built):
    sensor = exact(built("sensor", "sensor=ndir"), per_degc=2.5)
    u, t_s = unit(sensor), sensor.climate.period_s / 4
    u.step(420.0, t_s)
    assert reads(sensor, u.sample(0, t_s)) == pytest.approx(420.0 + 2.5 * sensor.climate.temperature_swing_degc, abs=0.06)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"elements": 3}, "elements is 3"),
        ({"background_ppm": -1.0}, "background_ppm is -1"),
        ({"resolution_ppm": 0.0}, "resolution_ppm is 0"),
    ],
)
def test_senseless_sensors_are_refused(built, changes, said):
    with pytest.raises(BadInput, match=said):
        replace(built("sensor"), **changes)
