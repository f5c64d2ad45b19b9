"""Worlds that change after calibration: each key does what it says, when it says, and to nothing else."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hardware.simulation.live_room import LiveRoom
from hardware.simulation.world_changes import seen_from_base
from oio.core.errors import BadInput
from oio.core.records import GasSample

pytestmark = pytest.mark.long

NAMES = sorted(path.stem for path in (Path(__file__).resolve().parents[3] / "conf" / "world").glob("*.yaml"))
PLACE = np.array([0.3, 0.05, 0.2])


@pytest.fixture
def changes(built):
    return lambda name="unchanged", **more: replace(built("world", f"world={name}"), **more)


@pytest.fixture
def room(built):
    def opened(changes, air="air=steady"):
        return LiveRoom(built("air", air).open(np.random.default_rng(1), np.random.default_rng(2)), changes, 420.0)

    return opened


def stepped(room, seconds_s):
    for _ in range(round(seconds_s / 0.1)):
        room.step(0.1)
    return room


@pytest.mark.parametrize("name", NAMES)
def test_every_world_is_built_changes_something_and_only_from_the_search_on(built, name, changes):
    world = changes(name)
    assert world.name == name
    assert (replace(world, name="unchanged") == changes()) is (name == "unchanged")
    sim = [built("backend", "sensor=ndir", "dof=5", "air=draft", f"world={w}", "backend.joint_period_s=0.1") for w in ("unchanged", name)]
    sensed = []
    for each in sim:
        with each.plant() as plant:
            plant.present("beacon")
            before = [_ticked(plant) for _ in range(20)]
            plant.present("source")
            sensed.append((before, [_ticked(plant) for _ in range(600)]))
    (before, after), (changed_before, changed_after) = sensed
    assert name == "more_backlash" or before == changed_before  # backlash is the arm's, from the start
    if name not in ("box", "arm_shadow"):  # which change what is behind them alone: see below
        assert (after == changed_after) is (name == "unchanged")


def _ticked(plant):
    plant.tick(plant.encoders() + np.array([0.01, -0.005, 0.0, 0.0, 0.0]) * np.cos(plant.ticks / 40.0))
    return plant.truth().ppm, plant.raw(0), plant.truth().nose_m.tolist()


def test_sides_are_seen_from_the_base():
    behind, left, above = seen_from_base(np.array([0.0, 0.4, 0.1]))
    np.testing.assert_allclose([behind, left, above], [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], atol=1e-12)


def test_a_wall_stands_on_the_side_that_is_named(changes, room):
    for side, direction in (("behind", 1.0), ("in_front", -1.0)):
        live = room(changes(walls_m={**changes().walls_m, side: 0.03}))
        live.present("source", PLACE, 1.0)
        behind, _, _ = seen_from_base(PLACE)
        assert live.ppm(PLACE + 0.04 * direction * behind, None) == 420.0 < live.ppm(PLACE - 0.04 * direction * behind, None)


def test_a_box_and_the_arm_shade_what_is_behind_them(changes, room):
    behind, _, _ = seen_from_base(PLACE)
    boxed, plain, shaded = room(changes("box")), room(changes()), room(changes("arm_shadow"))
    for live in (boxed, plain, shaded):
        live.present("source", PLACE, 1.0)
    far = PLACE + 0.2 * behind
    assert boxed.ppm(far, None) - 420.0 == pytest.approx(0.2 * (plain.ppm(far, None) - 420.0))
    joints = np.array([PLACE + 0.1 * behind + [0.0, 0.0, 0.1], PLACE + 0.1 * behind - [0.0, 0.0, 0.1], far - [0.0, 0.0, 0.1], far])
    assert shaded.casts_shadow and not plain.casts_shadow
    assert shaded.ppm(far, joints) - 420.0 == pytest.approx(0.2 * (plain.ppm(far, None) - 420.0))


def test_begins_start_changes_the_beacon_too(changes, room):
    early, late = (room(changes("wall", begins=when)) for when in ("start", "search"))
    for live in (early, late):
        live.present("beacon", PLACE, 1.0)
    behind, _, _ = seen_from_base(PLACE)
    assert early.ppm(PLACE + 0.04 * behind, None) == 420.0 < late.ppm(PLACE + 0.04 * behind, None)


def test_the_background_steps_and_climbs_from_the_opening_on(changes, room):
    live = room(changes(background_step_ppm=50.0, background_step_s=2.0, background_ramp_ppm_per_min=60.0))
    live.present("none", None, 0.0)
    assert stepped(live, 5.0).ppm(PLACE, None) == 420.0
    live.present("source", PLACE + 10.0, 0.0)
    assert stepped(live, 1.0).ppm(PLACE, None) == pytest.approx(421.0)
    assert stepped(live, 2.0).ppm(PLACE, None) == pytest.approx(473.0)


def test_the_wind_turns_when_it_is_due(changes, room):
    live = room(changes(wind=((2.0, 0.02, 0.0, 0.0),)))
    live.present("source", PLACE, 1.0)
    up, down = PLACE - np.array([0.1, 0.0, 0.0]), PLACE + np.array([0.1, 0.0, 0.0])
    assert stepped(live, 1.0).ppm(up, None) == pytest.approx(live.ppm(down, None))
    assert stepped(live, 2.0).ppm(up, None) < 0.5 * (live.ppm(down, None) - 420.0) + 420.0


def test_air_that_cannot_change_says_so(changes):
    class Still:
        def present(self, source_m, emission_ml_s):
            pass

        def step(self, dt_s):
            pass

        def ppm(self, p_m):
            return 0.0

    for name, told in (("second_source", "not alone"), ("wind_begins", "a wind that changes"), ("gusts", "does not meander")):
        with pytest.raises(BadInput, match=told):
            LiveRoom(Still(), changes(name), 420.0).present("source", PLACE, 1.0)


def test_the_nose_is_elsewhere_but_the_encoders_do_not_know(built):
    plain, moved = (built("backend", "sensor=ndir", "dof=5", "air=steady", f"world={w}") for w in ("unchanged", "nose_offset"))
    with plain.plant() as one, moved.plant() as other:
        for plant in (one, other):
            plant.present("source")
            plant.tick(plant.encoders())
        assert np.linalg.norm(one.truth().nose_m - other.truth().nose_m) == pytest.approx(0.01)
        np.testing.assert_array_equal(one.encoders(), other.encoders())


def test_the_lag_and_the_drift_grow_by_their_factors(built):
    plain, slow = (built("backend", "sensor=ndir", "dof=5", "air=steady", f"world={w}") for w in ("unchanged", "slower_sensor"))
    with plain.plant() as one, slow.plant() as other:
        for plant in (one, other):
            plant.present("source")
        assert other._sensor.unit._elements[0].tau_factor == 2.0 * one._sensor.unit._elements[0].tau_factor
    with built("backend", "sensor=ndir", "dof=5", "world=more_drift").plant() as plant:
        plant.present("source")
        for _ in range(500):
            plant.tick(plant.encoders())
        np.testing.assert_allclose(plant._encoders.offset, 10.0 * plant._encoders._half_accel * 10.0**2)


def test_a_whole_run_knows_its_world(built):
    with built("backend", "sensor=ndir", "dof=5", "world=fading").open() as world:
        world.present("source")
        assert any(isinstance(sample, GasSample) for sample in world.samples(1.0))


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ({"begins": "later"}, "world.begins has 'later', but it can be search or start"),
        ({"shape": "cube"}, "world.shape has 'cube'"),
        ({"walls_m": {"behind": -0.1}}, "walls_m.behind is -0.1, but 0.0001 to 10 is allowed"),
        ({"walls_m": {"east": 0.1}}, "world.walls_m has 'east'"),
        ({"further_strengths": (0.5,)}, "every further source needs both"),
        ({"further_strengths": (-0.5,), "further_offsets_m": ((0.0, 0.1, 0.0),)}, r"further_strengths\[0\] is -0.5, but 1e-06"),
        ({"box_low_m": (0.1, 0.0, 0.0)}, "a box needs both"),
        ({"box_low_m": (0.1, 0.0, 0.0), "box_high_m": (0.0, 0.1, 0.1)}, "the low corner below"),
        ({"wind": ((0.0, -1.0, 0.0, 0.0),)}, "a speed of 0 to 10 m/s"),
        ({"fade_s": 0.0}, "fade_s is 0, but 0.1"),
        ({"drift_factor": -1.0}, "drift_factor is -1"),
    ],
)
def test_worlds_that_make_no_sense_are_refused(changes, more, told):
    with pytest.raises(BadInput, match=told):
        changes(**more)


def test_a_stronger_source_is_as_much_stronger(changes, room):
    plain, strong = (room(changes(name)) for name in ("unchanged", "strong"))
    for live in (plain, strong):
        live.present("source", PLACE, 1.0)
    p = PLACE + np.array([0.0, 0.1, 0.0])
    assert strong.ppm(p, None) - 420.0 == pytest.approx(5.0 * (plain.ppm(p, None) - 420.0))


def test_fewer_puffs_hold_as_much_gas(built, changes):
    """Two puffs a second instead of forty: as much on average, and much rougher."""
    means, spreads, p = [], [], PLACE + np.array([0.0, 0.12, 0.0])
    for name in ("unchanged", "sparse"):
        seen = []
        for seed in range(12):
            air = built("air", "air=still").open(np.random.default_rng(seed), np.random.default_rng(100 + seed))
            live = LiveRoom(air, changes(name), 0.0)
            live.present("source", PLACE, 1.0)
            seen += [stepped(live, 0.5).ppm(p, None) for _ in range(20)]
        means.append(np.mean(seen))
        spreads.append(np.std(seen) / np.mean(seen))
    assert means[1] == pytest.approx(means[0], rel=0.3)
    assert spreads[1] > 1.5 * spreads[0]


def test_a_climate_swings_as_much_farther(built):
    plain, wild = (built("backend", "sensor=mox_mics", "dof=5", "air=steady", f"world={w}") for w in ("unchanged", "climate"))
    with plain.plant() as one, wild.plant() as other:
        slow = []
        for plant in (one, other):
            plant.present("source")
            plant._sensor.unit.step(0.0, 225.0)  # a quarter of the period
            slow.append(plant._sensor.unit._slow_signal())
        spread, climate = plain.sensor.spread, plain.sensor.climate
    swing = spread.per_degc * climate.temperature_swing_degc + spread.per_pct_rh * climate.humidity_swing_pct
    assert swing != 0.0 and slow[1] - slow[0] == pytest.approx(9.0 * swing)


def test_a_changed_world_needs_a_simulated_one():
    """A bench, a recording or a replay has the world that it has."""
    command = [sys.executable, "-m", "oio.run", "backend=recording", "recording=airscout32", "arm=gantry", "dof=3", "world=wall"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "world=wall changes the simulated world, but backend=recording is not simulated" in " ".join(done.stderr.split())
