"""The plant: what a bench samples is what a plant ticked by hand says, and what it offers to finer clocks agrees with its encoders."""

import math
from dataclasses import replace

import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.core.records import GasSample, JointState, Truth, nanoseconds, seconds
from oio.kinematics.minimum_jerk import minimum_jerk

QUIET = ("air=steady", "sensor=ndir")
STEP = 2 * math.pi / 4096


@pytest.fixture(scope="module")
def sim(built):
    return lambda dof=3, *more: built("backend", *QUIET, f"dof={dof}", *more)


def set_points(sim, goal, over_s, ticks):
    """Of the minimum-jerk move from home."""
    home = sim.arm.home
    tick_ns = nanoseconds(sim.joint_period_s)
    return [home + minimum_jerk(seconds(i * tick_ns) / over_s) * (goal - home) for i in range(ticks)]


@pytest.mark.parametrize("overrides", [(5, "sensor=ndir"), (2, "sensor=ec", "air=draft")])
def test_a_bench_is_a_plant_that_is_sampled(sim, overrides):
    sim = sim(*overrides)
    goal = sim.arm.home + 0.1
    with sim.open() as world:
        world.present("source")
        world.move(goal, 0.8)
        samples = list(world.samples(2.0))
    joints, gas, truths = ([s for s in samples if isinstance(s, kind)] for kind in (JointState, GasSample, Truth))
    with sim.plant() as plant:
        plant.present("source")
        for state, set_point in zip(joints, set_points(sim, goal, 0.8, 100), strict=True):
            plant.tick(set_point)
            np.testing.assert_array_equal(plant.encoders(), state.q)
            for sample in (s for s in gas if s.t_ns == plant.t_ns):
                assert plant.raw(sample.element) == sample.raw
            for truth in (s for s in truths if s.t_ns == plant.t_ns):
                np.testing.assert_array_equal(plant.truth().nose_m, truth.nose_m)
                assert plant.truth().ppm == truth.ppm
    assert len(gas) == 2.0 / sim.sensor.sample_s and plant.ticks == 100


def test_encoders_are_the_fine_angle_in_whole_counts(sim):
    with sim(5, "arm.homing_offset_deg=1.0").plant() as plant:
        for _ in range(20):
            plant.tick(plant.fine_angles() + 0.01)
            np.testing.assert_allclose(plant.encoders(), STEP * np.rint(plant.fine_angles() / STEP), atol=1e-12)
    assert np.max(np.abs(plant.encoders() - plant.fine_angles())) > 1e-5


def test_a_still_arm_carries_itself_and_a_pushed_one_is_at_its_most(sim):
    sim = sim(5)
    with sim.plant() as plant:
        for _ in range(50):
            plant.tick(sim.arm.home)
        assert 0.05 < np.max(np.abs(plant.load())) < 0.9
        plant.tick(sim.arm.home + np.array([0.0, 1.0, 0.0, 0.0, 0.0]))
        assert plant.load()[1] == pytest.approx(1.0)
        assert np.all(np.abs(plant.load()) <= 1.0)


def test_a_smooth_move_strains_nobody(sim):
    """What the servos do within a tick, from one end of their range to the other, is not what they carry."""
    sim = sim(5)
    with sim.plant() as plant:
        loads = []
        for set_point in set_points(sim, sim.arm.home + 0.3, 1.5, 75):
            plant.tick(set_point)
            loads.append(np.abs(plant.load()))
    assert np.max(np.mean(loads, axis=0)) < 0.5


def test_an_arm_without_limits_of_torque_carries_nothing(built):
    bench = built("backend", "arm=gantry", "dof=3", *QUIET, "beacon.position=[3.0,2.0,1.0]", "source.position=[2.0,2.0,1.0]")
    with bench.plant() as plant:
        plant.tick(bench.arm.home)
        limited = np.max(np.abs(plant._model.actuator_forcerange), axis=1) > 0
        assert np.all(plant.load()[~limited] == 0.0) and np.all(np.abs(plant.load()) <= 1.0)


def test_time_goes_by_ticks_alone(sim):
    with sim().plant() as plant:
        assert plant.t_ns == 0 and plant.tick_ns == 20_000_000
        plant.present("beacon")
        plant.truth()
        assert plant.t_ns == 0
        plant.tick(np.zeros(3))
        assert seconds(plant.t_ns) == 0.02


def test_places_are_those_of_the_truth(sim):
    with sim().plant() as plant:
        plant.present("source")
        np.testing.assert_array_equal(plant.truth().source_m, plant.places["source"])
        plant.present("none")
        assert np.all(np.isnan(plant.truth().source_m))


def test_what_is_unknown_is_refused(sim):
    with sim().plant() as plant, pytest.raises(BadInput, match=r"present\('tea'\)"):
        plant.present("tea")
    with pytest.raises(BadInput, match="multiple of the MJCF's"), replace(sim(), joint_period_s=0.0205).plant():
        pass
