"""The simulated bench: it keeps a backend's promises, and its encoders, free play and seeds do what the configuration says."""

import copy
import hashlib
import itertools
import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from hardware.simulation.mujoco_model import compile_model
from oio.core.errors import BadInput, OioError
from oio.core.records import GasSample, JointState, Truth, seconds
from oio.core.seeds import Seeds
from oio.testing import check_backend

QUIET = ("air=steady", "sensor=ndir")  # air without puffs: cheap


@pytest.fixture(scope="module")
def sim(built):
    """sim(dof=3, encoder_drift_deg_s2=0.0): a bench with changes to its arm."""
    return lambda dof=5, **changes: replace(
        built("backend", *QUIET, f"dof={dof}"), arm=replace(built("arm", *QUIET, f"dof={dof}"), **changes)
    )


def ran(backend, for_s, moves=(), source="none", every_s=None):
    """All samples of a run in which the next move begins every `every_s`."""
    with backend.open() as world:
        world.present(source)
        out = []
        for goal in moves:
            world.move(np.asarray(goal), 0.8 * every_s)
            out += world.samples(every_s)
        return out + list(world.samples(for_s))


def of(samples, kind):
    return [s for s in samples if isinstance(s, kind)]


def digest(samples):
    """Of every number that was yielded."""
    state = hashlib.sha256()
    for s in samples:
        for name in s.__slots__:
            state.update(np.asarray(getattr(s, name), dtype=float).tobytes())
    return state.hexdigest()


@pytest.mark.parametrize("dof", [1, 2, 3, 5])
def test_it_keeps_a_backends_promises(sim, dof):
    check_backend(sim(dof))


def test_the_guard_accounts_for_what_the_arm_was_held_to(sim):
    backend = sim(3)
    with backend.open() as world:
        still = world.guard_account()
        world.move(backend.arm.home + np.array([0.6, 0.0, 0.0]), 0.1)
        list(world.samples(1.5))
        moved = world.guard_account()
    assert still.top_speed_m_s == 0.0 and still.load_unwatched == backend.arm.names
    assert 0.3 < moved.top_speed_m_s <= 1.01 * moved.speed_limit_m_s and moved.load_unwatched == moved.without_limit == ()


def test_in_puffs_and_with_twins_too(built):
    check_backend(built("backend", "air=draft", "sensor=mox_mics"))


def test_the_gantry_is_moved_as_well(built):
    backend = built("backend", "arm=gantry", "dof=3", "air=steady", "beacon.position=[3.0,2.0,1.0]", "source.position=[2.0,2.0,1.0]")
    goal = np.array([2.0, 2.5, 1.0])
    last = of(ran(backend, 6.0, [goal], every_s=8.0), Truth)[-1]
    np.testing.assert_allclose(last.nose_m, goal, atol=0.02)


def test_joints_come_50_times_a_second_gas_as_often_as_its_sensor(sim):
    samples = ran(sim(), 2.0)
    joints, gas = of(samples, JointState), of(samples, GasSample)
    assert [s.t_ns for s in joints] == [20_000_000 * i for i in range(1, 101)]
    assert [s.t_ns for s in gas] == [100_000_000 * i for i in range(1, 21)]
    assert {s.t_ns for s in gas} <= {s.t_ns for s in of(samples, Truth)}


def test_twins_are_read_in_turn(built):
    gas = of(ran(built("backend", "air=steady", "sensor=ec"), 5.0), GasSample)
    assert [s.element for s in gas] == [0, 1] * 5


def test_uneven_spans_lose_no_time(sim):
    with sim().open() as world:
        world.present("none")
        count = sum(isinstance(s, JointState) for _ in range(10) for s in world.samples(0.1))
        assert count == 50 and world.t_ns == 1_000_000_000
        assert list(world.samples(0.019)) == [] and world.t_ns == 1_000_000_000


@pytest.mark.parametrize("dof", [1, 3, 5])
def test_the_nose_goes_where_it_is_sent(sim, dof):
    bench = sim(dof, encoder_drift_deg_s2=0.0)
    goal = bench.arm.home + 0.15
    last = of(ran(bench, 1.0, [goal], every_s=2.0), Truth)[-1]
    assert np.linalg.norm(last.nose_m - bench.arm.nose(goal)) < 0.012  # the servos sag, and there is free play
    np.testing.assert_allclose(of(ran(bench, 0.5), Truth)[-1].nose_m, bench.arm.nose(bench.arm.home), atol=0.012)


def test_encoders_count(sim):
    step = 2 * math.pi / 4096
    q = np.array([s.q for s in of(ran(sim(), 1.0), JointState)]) / step
    np.testing.assert_allclose(q, np.round(q), atol=1e-6)


def test_velocity_and_acceleration_are_differences_of_counts(sim):
    bench = sim(3)
    joints = of(ran(bench, 0.2, [bench.arm.home + 0.1], every_s=1.0), JointState)
    q, dq, ddq = (np.array([getattr(s, name) for s in joints]) for name in ("q", "dq", "ddq"))
    np.testing.assert_allclose(dq[1:], np.diff(q, axis=0) / 0.02)
    np.testing.assert_allclose(ddq[1:], np.diff(dq, axis=0) / 0.02)


def drift_of(bench, for_s=20.0):
    """Encoder minus true angle (k, n) rad and its times (k,) s."""
    samples = ran(bench, for_s)
    true = {s.t_ns: s.q for s in of(samples, Truth)}
    joints = [s for s in of(samples, JointState) if s.t_ns in true]
    return np.array([s.q - true[s.t_ns] for s in joints]), np.array([seconds(s.t_ns) for s in joints])


def test_encoders_drift_quadratically_and_within_the_bound(sim):
    bound, joints = 0.02, []  # deg/s^2: large, to be seen above a count
    for seed in range(3):
        bench = replace(sim(5, encoder_drift_deg_s2=bound), seeds=Seeds(truth=seed, disturbance=0, measurement=0))
        off, t = drift_of(bench)
        accel = 2 * off[-1] / t[-1] ** 2
        np.testing.assert_allclose(off, 0.5 * accel * t[:, None] ** 2, atol=2 * math.pi / 4096)
        joints += list(np.degrees(accel))
    assert np.all(np.abs(joints) < 1.05 * bound) and np.max(np.abs(joints)) > 0.4 * bound
    assert len(np.unique(np.round(joints, 9))) == 15  # each joint its own


def test_without_drift_and_homing_encoders_are_true(sim):
    off, _ = drift_of(sim(encoder_drift_deg_s2=0.0, homing_offset_deg=0.0), 2.0)
    assert np.max(np.abs(off)) <= 0.51 * 2 * math.pi / 4096


def test_a_homing_offset_is_constant(sim):
    off, _ = drift_of(sim(encoder_drift_deg_s2=0.0, homing_offset_deg=2.0), 2.0)
    assert np.max(np.abs(np.degrees(off[0]))) > 0.5
    np.testing.assert_allclose(off, off[0] * np.ones_like(off), atol=2 * math.pi / 4096)


def test_the_drifting_servo_pulls_the_nose_off(sim):
    """The encoder is what the servo holds: it reads what was asked for, and the nose is elsewhere."""
    bench = sim(3, encoder_drift_deg_s2=0.02, backlash_deg=0.0)
    samples = ran(bench, 20.0)
    truths, last = of(samples, Truth), of(samples, JointState)[-1]
    np.testing.assert_allclose(last.q, of(samples, JointState)[0].q, atol=3 * 2 * math.pi / 4096)
    assert np.linalg.norm(truths[-1].nose_m - truths[0].nose_m) > 0.003


def reversals(bench, by_rad=0.3):
    """By how much the same goal, come to from by_rad below and above, leaves the nose in different places [m]."""
    home, step = bench.arm.home, np.zeros(bench.arm.dof)
    step[0] = by_rad
    samples = ran(bench, 0.1, [home - step, home, home + step, home], every_s=2.0)
    at = {round(seconds(s.t_ns), 2): s.nose_m for s in of(samples, Truth)}
    return float(np.linalg.norm(at[4.0] - at[8.0]))


def test_free_play_shows_when_the_direction_turns(sim):
    """Where a link comes to rest within its play is chaos, at any step of the physics: 2.7 mm in the mean, 1.5 mm spread."""
    play = [reversals(sim(2, backlash_deg=1.0, encoder_drift_deg_s2=0.0), by_rad) for by_rad in (0.25, 0.3, 0.35, 0.4)]
    assert np.mean(play) > 1e-3 and np.max(play) < math.radians(1.0) * 0.35
    tight, loose = (reversals(sim(1, backlash_deg=play, encoder_drift_deg_s2=0.0)) for play in (0.0, 3.0))
    assert tight < 1e-4
    assert 3e-3 < loose < math.radians(3.0) * 0.35  # the nose is 0.3 m from the axis; never more than the play itself
    play = [name for name in joint_names(sim(3)) if name.endswith("_play")]
    assert play == ["shoulder_azimuth_play", "shoulder_elevation_play", "elbow_tilt_play"]
    assert not any(name.endswith("_play") for name in joint_names(sim(3, backlash_deg=0.0)))


def joint_names(bench):
    model, _ = compile_model(bench.arm)
    return [model.joint(i).name for i in range(model.njnt)]


def test_free_play_hides_from_the_encoders(sim):
    """Truth of the unlocked joints is before the play: the nose is off by up to half of it."""
    bench = sim(2, backlash_deg=4.0, encoder_drift_deg_s2=0.0)
    truth = of(ran(bench, 1.0), Truth)[-1]
    off = np.linalg.norm(truth.nose_m - bench.arm.nose(truth.q))
    assert 1e-3 < off < 2 * math.radians(2.0) * 0.5 + 1e-3


def test_the_truth_of_the_gas_is_what_the_air_says_at_the_nose(built, sim):
    bench = sim(3)
    truth = of(ran(bench, 1.0, source="beacon"), Truth)[-1]
    np.testing.assert_array_equal(truth.source_m, bench.beacon.position)
    air = bench.air.open(np.random.default_rng(0), np.random.default_rng(0))
    air.present(np.array(bench.beacon.position), bench.emission_ml_s)
    assert truth.ppm == pytest.approx(bench.background_ppm + air.ppm(truth.nose_m))
    assert np.all(np.isnan(of(ran(bench, 0.2), Truth)[0].source_m))


def test_the_same_seeds_give_the_same_bytes(built):
    backend = built("backend", "air=draft", "seed=3")
    goal = backend.arm.home + 0.1
    once, again = (digest(ran(backend, 0.5, [goal], "source", 1.5)) for _ in range(2))
    assert once == again != digest(ran(built("backend", "air=draft", "seed=4"), 0.5, [goal], "source", 1.5))


def test_the_seed_of_the_measurement_changes_noise_alone(built):
    one, other = (built("backend", "air=draft", f"seeds.measurement={seed}") for seed in (0, 1))
    a, b = (ran(backend, 0.5, [backend.arm.home + 0.1], "source", 2.5) for backend in (one, other))
    assert digest(of(a, Truth)) == digest(of(b, Truth)) and digest(of(a, JointState)) == digest(of(b, JointState))
    assert digest(of(a, GasSample)) != digest(of(b, GasSample))


def test_the_seed_of_the_disturbance_changes_the_gas_and_not_the_place(built):
    one, other = (built("backend", "air=draft", f"seeds.disturbance={seed}") for seed in (0, 1))
    a, b = (of(ran(backend, 0.5, source="source"), Truth) for backend in (one, other))
    assert a[-1].ppm != b[-1].ppm
    np.testing.assert_array_equal(a[-1].source_m, b[-1].source_m)
    assert digest(of(ran(one, 0.5), JointState)) == digest(of(ran(other, 0.5), JointState))


def test_an_unknown_source_is_refused_with_the_known_ones(sim):
    with sim().open() as world, pytest.raises(BadInput, match=r"present\('tea'\) was asked for, but a world has none, beacon, source"):
        world.present("tea")


def test_a_period_that_physics_cannot_honour_is_refused(sim):
    odd = replace(sim(), joint_period_s=0.0205)
    with pytest.raises(BadInput, match=r"must be a multiple of the MJCF's 0.004 s"), odd.open():
        pass


def test_a_beacon_out_of_reach_is_refused_at_the_opening(sim):
    away = replace(sim(), beacon=replace(sim().beacon, position=(1.5, 0.0, 0.2)))
    with pytest.raises(BadInput, match=r"beacon.position is \[1.5, 0.0, 0.2\]"), away.open():
        pass


@pytest.mark.parametrize("goal", [[np.nan, 0.0, 0.0], [0.0, np.inf, 0.0], [0.0, 0.0], [0.0] * 5, 0.0, [[0.0, 0.0, 0.0]]])
def test_a_goal_of_another_length_or_not_finite_is_refused_and_nothing_is_set(sim, goal):
    bench = sim(3)
    with bench.open() as world:
        world.present("none")
        with pytest.raises(BadInput, match=r"was asked for, but dof=3 takes 3 finite numbers"):
            world.move(np.array(goal), 1.0)
        assert digest(world.samples(0.5)) == digest(ran(bench, 0.5))


def test_a_goal_under_the_table_is_refused_and_nothing_is_set(sim):
    """In front of every backend: stages are not asked to check their commands."""
    bench = sim(3)
    with bench.open() as world:
        world.present("none")
        with pytest.raises(BadInput, match=r"nose at \[0.252, -0.066, -0.036\] m\) was asked for"):
            world.move(bench.arm.home + 0.3, 1.0)
        assert digest(world.samples(0.5)) == digest(ran(bench, 0.5))


def test_a_move_that_is_too_fast_is_slowed_and_says_so(sim):
    bench = sim(3)
    goal = bench.arm.home + np.array([1.0, 0.1, 0.1])
    with bench.open() as world:
        world.present("none")
        lasts_s = world.move(goal, 0.01)
        assert lasts_s > 1.0
        q = np.array([s.q for s in of(world.samples(lasts_s + 1.0), JointState)])
    np.testing.assert_allclose(q[-1], goal, atol=0.01)
    assert np.max(np.abs(np.diff(q, axis=0))) / 0.02 < 1.2 * bench.arm.joint_speed  # encoder counts are coarse


def test_whoever_stops_the_run_stops_the_arm(sim):
    """Ctrl-C, SIGTERM and errors leave the bench through the same door."""
    opened = []
    with pytest.raises(KeyboardInterrupt), sim(3).open() as world:
        opened.append(world)
        raise KeyboardInterrupt
    with pytest.raises(OioError, match="held where it is: the run is over"):
        opened[0].move(sim(3).arm.home, 1.0)


def test_an_arm_that_strains_for_long_is_held_but_not_one_at_its_stop(sim):
    """The guard feels the simulated servos; where drifting encoders push a joint against its stop it feels nothing."""
    strained = replace(sim(5), safety=replace(sim(5).safety, load=0.05, load_s=0.1))
    with strained.open() as world:
        list(world.samples(2.0))
        with pytest.raises(OioError, match="more than 5 % of its torque"):
            world.move(strained.arm.home, 1.0)
    with sim(5).open() as world:
        beyond = sim(5).arm.home + np.array([math.radians(120.0), 0.0, 0.0, 0.0, 0.0])
        for _ in range(300):
            world._plant.tick(beyond)
            world._report_load(seconds(world.t_ns))
        assert world._plant.at_stop().tolist() == [True, False, False, False, False]
        assert world._plant.load()[0] > 0.9 and world.guard.held is None


def test_a_goal_that_is_changed_afterwards_changes_no_move(sim):
    bench = sim(3)
    goal = bench.arm.home + 0.1
    with bench.open() as world:
        world.present("none")
        world.move(goal, 0.4)
        goal[:] = 0.0
        assert digest(world.samples(0.5)) == digest(ran(bench, 0.0, [bench.arm.home + 0.1], every_s=0.5))


def test_a_warning_of_the_physics_is_an_error_and_writes_no_file(sim, monkeypatch, tmp_path):
    """Bearings that push instead of brake."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wild").mkdir()
    wild = tmp_path / "wild" / "arm.xml"
    wild.write_text(sim().arm.path.read_text().replace('damping="0.60"', 'damping="-60"'))
    before = mujoco.get_mju_user_warning()
    with (
        pytest.raises(OioError, match=r"physics of .*arm.xml broke down after 0\.000 s. MuJoCo says: .*Check masses"),
        replace(sim(), arm=replace(sim().arm, mjcf=str(wild))).open(),
    ):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["wild"]
    assert mujoco.get_mju_user_warning() is before


def test_physics_that_break_down_on_the_way_are_an_error_too(sim, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    with sim(3).open() as world:
        list(world.samples(0.1))
        world._plant._data.qvel[0] = np.nan
        with pytest.raises(OioError, match=r"broke down after 0\.100 s. MuJoCo says: Nan, Inf or huge value in QVEL"):
            list(world.samples(0.1))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("words", [("air=draft", "world=wall"), ("air=ventilated", "sensor=mox_mics", "world=arm_shadow"), QUIET])
def test_a_copy_of_a_world_goes_on_as_the_world_does_and_changes_nothing_in_it(built, words):
    backend = built("backend", *words)
    with backend.open() as world:
        world.present("source")
        world.move(backend.arm.home + 0.1, 0.5)
        list(world.samples(0.23))  # on its way, between two reports of the load
        kept = copy.deepcopy(world)
        expected = digest(world.samples(2.0))
    for _ in range(2):
        with backend.resume(kept) as again:
            assert digest(again.samples(2.0)) == expected
            with pytest.raises(OioError, match="broke down"):
                again._plant._data.qvel[0] = np.nan
                list(again.samples(0.1))


def test_a_late_reading_is_what_was_sensed_before(sim):
    """The same values with later stamps, in the order of time; the arm is not late."""
    prompt, late = (ran(replace(sim(3), gas_delay_s=delay_s), 2.0, source="beacon") for delay_s in (0.0, 0.16))
    times = [s.t_ns for s in late]
    assert times == sorted(times)
    for a, b in zip(of(prompt, GasSample), of(late, GasSample), strict=False):
        assert b.t_ns - a.t_ns == 160_000_000 and (a.element, a.raw) == (b.element, b.raw)
    assert 0 < len(of(late, GasSample)) < len(of(prompt, GasSample))
    assert digest(of(prompt, JointState)) == digest(of(late, JointState))


class Rising:
    """Gas that grows evenly everywhere: what a nose at constant speed feels in an even gradient."""

    name, per_s = "rising", 1000.0  # ppm/s

    def open(self, truth, disturbance):
        return Rising()

    def present(self, source_m, emission_ml_s):
        self._t_s = 0.0

    def step(self, dt_s):
        self._t_s += dt_s

    def ppm(self, p_m):
        return self.per_s * self._t_s


def smelling(bench, **changes):
    """The same bench with a sensor that adds nothing of its own, and every tick in its truth."""
    nothing = ("gain", "bias", "tau", "drift_per_sqrt_h", "warm_up", "noise", "per_degc", "per_pct_rh")
    spread = replace(bench.sensor.spread, **dict.fromkeys(nothing, 0.0))
    return replace(bench, sensor=replace(bench.sensor, spread=spread), truth_every=1, **changes)


def smelt(bench, samples):
    """Times (k,) s and readings (k,) ppm."""
    readings = [bench.sensor.reading(s) for s in of(samples, GasSample)]
    return np.array([seconds(r.t_ns) for r in readings]), np.array([r.ppm for r in readings])


@pytest.mark.parametrize("tick_s", [0.004, 0.02, 0.1])
def test_the_gas_is_not_ahead_of_the_nose(sim, tick_s):
    """A first-order lag follows a ramp at tau x slope behind it, exactly, however coarse the ticks; half a tick of lead is 2 to 50 ppm."""
    bench = smelling(sim(3), air=Rising(), joint_period_s=tick_s, air_every=1)
    t_s, ppm = smelt(bench, ran(bench, 4.0, source="beacon"))
    tau_s, late = bench.sensor.dynamics.tau_rise_s, t_s > 3.0
    behind = bench.background_ppm + Rising.per_s * (t_s - tau_s) - ppm
    assert np.sum(late) > 5
    np.testing.assert_allclose(behind[late], 0.0, atol=Rising.per_s * tick_s**2 / tau_s / 6.0 + bench.sensor.step_ppm)


def test_on_a_move_through_a_plume_the_sensor_lags_behind_what_the_nose_felt(sim):
    """The lag of gas that goes evenly from tick to tick (first-order hold), within a tenth of what the gas of either end would miss by."""
    bench = smelling(sim(3))
    samples = ran(bench, 0.5, [bench.arm.home + np.array([0.3, 0.1, 0.1]), bench.arm.home], "beacon", 1.0)
    t_s, ppm = smelt(bench, samples)
    felt, d, dt_s = [bench.background_ppm, *(truth.ppm for truth in of(samples, Truth))], bench.sensor.dynamics, bench.joint_period_s
    even, ended = [0.5 * (felt[0] + felt[1])] * 2  # the first tick is where it begins
    follows = [(even, ended)]
    for before, now in itertools.pairwise(felt[1:]):
        tau_s = d.tau_rise_s if 0.5 * (before + now) > even else d.tau_fall_s
        keep = math.exp(-dt_s / tau_s)
        even = keep * even + now - keep * before - (1.0 - keep) * tau_s / dt_s * (now - before)
        ended = keep * ended + (1.0 - keep) * now
        follows.append((even, ended))
    at = np.rint(t_s / dt_s).astype(int) - 1
    off, off_ended = np.max(np.abs(np.array(follows)[at] - ppm[:, None]), axis=0)
    assert off < 0.1 * off_ended and off < 2.0 * bench.sensor.step_ppm
