"""The guard: whatever it is told and whenever it is asked, no set-point leaves limits, box and speeds; what is allowed goes as ever."""

import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oio.core.errors import BadInput, OioError
from oio.gas.source import unlocked
from oio.kinematics.minimum_jerk import minimum_jerk
from oio.motion.guard import HOST, NOSE, SPEED_TOLERANCE, Guard
from oio.runtime.guarded_world import GuardedWorld

ARMS = [("dof=1",), ("dof=2",), ("dof=3",), ("dof=5",), ("arm=gantry", "dof=3")]
TICK_S = 0.02
FOLDED = np.array([1.783, -1.518, -1.527])  # backwards, with the nose to the front: in the box, but cut off
SIDEWAYS = np.array([0.3, 0.1, 0.1])  # of home, rad
BOW_M = 5e-5  # between places at which a way was looked at
ODD = st.floats() | st.sampled_from([0.0, -1.0, 1e300, float("nan"), float("inf"), float("-inf")])


@pytest.fixture(scope="session")
def made(built):
    """made("dof=3", heartbeat_timeout_s=9.0): an arm and its limits."""

    def make(*words, **changes):
        return built("arm", *words), replace(built("safety", *words), **changes)

    return make


def stood(arm, safety, **more):
    guard = Guard(arm, safety, **more)
    guard.begin(arm.home)
    return guard


def pairs(arm, seed, count, free=True):
    """Poses (n,) to go from and to, whose straight way is free or is not."""
    rng = np.random.default_rng(seed)
    found = []
    while len(found) < count:
        a, b = arm.random_poses(rng, 2)
        if bool(arm.path_is_free(a, b)) is free:
            found.append((a, b))
    return found


def heard(guard, t_s):
    guard.heartbeat(t_s, HOST)
    guard.heartbeat(t_s, NOSE)
    return guard.set_point(t_s)


def stream(guard, until_s, since_s=0.0, tick_s=TICK_S):
    """Set-points (k, n) of a caller that is never late."""
    return np.array([heard(guard, since_s + k * tick_s) for k in range(round((until_s - since_s) / tick_s) + 1)])


class Caller:
    """Asks for set-points by a clock of its own, and looks at each."""

    def __init__(self, arm, safety):
        self.arm, self.safety, self.guard = arm, safety, stood(arm, safety)
        self.t_s, self.gone_s, self.last = 0.0, 0.0, arm.home
        self.rng = np.random.default_rng(0)
        self.guard.set_point(0.0)  # from here on it knows how old a command is

    def clock(self, for_s):
        self.t_s += for_s
        self.gone_s += max(for_s, 0.0)

    def look(self):
        held = self.guard.held
        q, arm = self.guard.set_point(self.t_s), self.arm
        assert np.all(q >= arm.low_rad - 1e-9) and np.all(q <= arm.high_rad + 1e-9)
        p, margin = arm.nose(q), self.safety.box_margin_m + BOW_M
        assert np.all(p >= np.array(arm.box_low_m) - margin) and np.all(p <= np.array(arm.box_high_m) + margin)
        for_s, most = min(self.gone_s, self.safety.step_s), SPEED_TOLERANCE * (1.0 + 2e-3)
        assert np.max(np.abs(q - self.last)) <= most * arm.joint_speed * for_s + 1e-9
        assert np.linalg.norm(p - arm.nose(self.last)) <= most * arm.nose_limit_m_s * for_s + 1e-9
        if held is not None:
            assert self.guard.held == held and (self.gone_s == 0.0 or np.array_equal(q, self.guard.set_point(self.t_s + 1.0)))
        self.last, self.gone_s = q, 0.0

    def tick(self, for_s):
        self.clock(for_s)
        self.look()

    def ticks(self, count, hear):
        for _ in range(count):
            if hear:
                self.guard.heartbeat(self.t_s, HOST)
                self.guard.heartbeat(self.t_s, NOSE)
            self.tick(TICK_S)

    def move(self, goal, over_s, age_s):
        held = self.guard.held
        if age_s < 0.0 and np.isfinite(age_s):
            self.gone_s -= age_s  # what is told is the time, though the caller's clock is behind it
        try:
            lasts_s = self.guard.move(goal, over_s, self.t_s - age_s)
        except OioError as error:
            assert isinstance(error, BadInput) or held is not None
        else:
            assert held is None and lasts_s >= over_s * (1.0 - 1e-12)
            assert self.arm.is_allowed(np.array(goal))

    def go(self, over_s, age_s):
        self.move(self.arm.random_pose(self.rng), over_s, age_s)

    def near(self, size, over_s):
        """A small step about where it is, as often out of the box as not."""
        self.move(self.last + size * self.rng.standard_normal(self.arm.dof), over_s, 0.0)

    def report_load(self, load, hot):
        self.guard.report_load(self.t_s, np.resize(load, self.arm.dof), np.resize(hot, self.arm.dof))

    def heartbeat(self, who, t_s):
        self.guard.heartbeat(t_s, who)

    def stop(self):
        self.guard.stop("a test")

    def begin(self):
        self.guard.begin(self.last)


OVER_S = st.floats(0.01, 10.0)
STEPS = st.one_of(
    st.tuples(st.just("tick"), st.floats(1e-4, 0.3)),
    st.tuples(st.just("tick"), st.floats(-3.0, 30.0)),
    st.tuples(st.just("ticks"), st.integers(1, 100), st.sampled_from([True, True, True, False])),
    st.tuples(st.just("clock"), st.floats(-0.2, 0.2)),
    st.tuples(st.just("go"), OVER_S, st.floats(-0.1, 1.0)),
    st.tuples(st.just("near"), st.sampled_from([0.01, 0.1, 1.0]), OVER_S),
    st.tuples(st.just("move"), st.lists(ODD | st.floats(-2.0, 2.0), max_size=7), OVER_S | ODD, st.floats(-0.1, 1.0) | ODD),
    st.tuples(st.just("report_load"), st.lists(ODD | st.floats(-1.0, 1.0), min_size=1, max_size=5), st.lists(ODD, min_size=1, max_size=5)),
    st.tuples(st.just("heartbeat"), st.sampled_from([HOST, NOSE]), ODD),
    st.tuples(st.just("stop")),
    st.tuples(st.just("begin")),
    st.tuples(st.just("begin")),
)


def assert_obeys(made, words, examples, most):
    """`Caller.look` asserts the limits after every step."""

    @settings(max_examples=examples)
    @given(st.lists(STEPS, min_size=5, max_size=most))
    def obeys(steps):
        caller = Caller(*made(*words))
        for what, *how in steps:
            getattr(caller, what)(*how)
            caller.look()

    obeys()


def test_a_goal_next_to_infinity_is_refused_with_its_value(made):
    """What would overflow in the message must not."""
    with pytest.raises(BadInput, match=r"a move to \[0.0, 1.797693134862316e\+304\] rad"):
        stood(*made("dof=2")).move(np.array([0.0, 1.797693134862316e304]), 1.0, 0.0)


@pytest.mark.parametrize("words", ARMS)
def test_no_sequence_of_commands_leaves_limits_box_and_speeds(made, words):
    assert_obeys(made, words, examples=40, most=40)


@pytest.mark.slow
@pytest.mark.parametrize("words", ARMS)
def test_no_sequence_of_thousands_either(made, words):
    assert_obeys(made, words, examples=2000, most=60)


@pytest.mark.parametrize("words", ARMS)
def test_what_is_allowed_goes_as_it_ever_did_to_the_bit(made, words):
    """Minimum jerk from where the set-point is, each move begun before the one before has ended."""
    arm, safety = made(*words)
    guard, rng, goals = stood(arm, safety), np.random.default_rng(1), 0
    start, turn, began_s, over_s = arm.home, np.zeros(arm.dof), 0.0, 0.1
    for k in range(1500):
        t_s = 1e-9 * (k * 20_000_000)
        if k % 100 == 0:
            here, goal = start + minimum_jerk((t_s - began_s) / over_s) * turn, arm.random_pose(rng)
            if arm.path_is_free(here, goal):
                start, turn, began_s, over_s, goals = here, goal - here, t_s, float(arm.duration_s(here, goal)) + 1.0, goals + 1
                assert guard.move(goal, over_s, t_s) == over_s
        np.testing.assert_array_equal(heard(guard, t_s), start + minimum_jerk((t_s - began_s) / over_s) * turn)
    assert goals > 5


@pytest.mark.parametrize(
    ("goal", "over_s", "age_s", "said"),
    [
        ([np.nan, 0.0, 0.0], 1.0, 0.0, r"\[nan, 0.0, 0.0\] was asked for, but dof=3 takes 3 finite numbers"),
        ([0.0, np.inf, 0.0], 1.0, 0.0, "takes 3 finite numbers"),
        ([0.0] * 5, 1.0, 0.0, "takes 3 finite numbers. Type e.g."),
        ([0.0], 1.0, 0.0, "takes 3 finite numbers"),
        (0.0, 1.0, 0.0, "takes 3 finite numbers"),
        ([2.5, -1.0, 0.6], 1.0, 0.0, "joints may go from"),
        ([0.3, -0.7, 0.9], 1.0, 0.0, "the nose from"),  # 36 mm under the table
        ([0.0, -1.0, 0.6], 0.0, 0.0, "some time to move"),
        ([0.0, -1.0, 0.6], np.nan, 0.0, "finite times"),
        ([0.0, -1.0, 0.6], np.inf, 0.0, "finite times"),
        ([0.0, -1.0, 0.6], 1.0, np.nan, "finite times"),
        ([0.0, -1.0, 0.6], 1.0, 0.6, r"came 0\.58 s after it was commanded; safety.command_age_s=0.5 s"),
        (FOLDED, 1.0, 0.0, "no path was found"),
    ],
)
def test_a_refused_command_harms_nothing(made, goal, over_s, age_s, said):
    """NaN, infinity, another length, out of limits or box, no time, stale, or without a path: the move under way goes on to the bit."""
    arm, safety = made("dof=3")
    refusing, other = stood(arm, safety), stood(arm, safety)
    for guard in (refusing, other):
        guard.move(arm.home + SIDEWAYS, 2.0, 0.0)
        stream(guard, 1.0)
    with pytest.raises(BadInput, match=said):
        refusing.move(goal, over_s, 1.0 + TICK_S - age_s)
    np.testing.assert_array_equal(stream(refusing, 3.0, 1.0 + TICK_S), stream(other, 3.0, 1.0 + TICK_S))
    assert refusing.held is None and refusing.arrived


@pytest.mark.parametrize("nose_limit", [1.0, 0.2])
@pytest.mark.parametrize("words", ARMS)
def test_a_move_that_is_too_fast_takes_the_time_it_must(made, words, nose_limit):
    """It arrives when the guard said, and at its fastest it is as fast as the joints or the nose may be."""
    arm, safety = made(*words)
    arm = replace(arm, nose_limit_m_s=nose_limit * arm.nose_limit_m_s)
    for a, b in pairs(arm, 2, 5):
        guard = Guard(arm, safety)
        guard.begin(a)
        lasts_s = guard.move(b, 0.01, 0.0)
        fine_s = lasts_s / 1000
        q = stream(guard, lasts_s + 0.1, 0.0, fine_s)
        joints = np.max(np.abs(np.diff(q, axis=0))) / fine_s / arm.joint_speed
        nose = np.max(np.linalg.norm(np.diff(arm.nose(q), axis=0), axis=1)) / fine_s / arm.nose_limit_m_s
        assert max(joints, nose) == pytest.approx(SPEED_TOLERANCE, rel=2e-3)
        np.testing.assert_allclose(q[-1], b, atol=1e-12)
        assert np.max(np.abs(q[990] - b)) > 0.0


def test_over_obstacles_of_the_box_the_arm_arrives_when_it_said(made):
    """The straight way would take the nose out; the way goes round, and stages, log and guard agree on how long it takes."""
    arm, safety = made("dof=5")
    gone, low, high = 0, np.array(arm.box_low_m) - safety.box_margin_m - BOW_M, np.array(arm.box_high_m) + safety.box_margin_m + BOW_M
    for a, b in pairs(arm, 3, 12, free=False):
        guard, watched = Guard(arm, safety), GuardedWorld(None, arm, None)
        guard.begin(a)
        watched._goal = a
        try:
            over_s = watched.move_s(b)
        except BadInput:
            with pytest.raises(BadInput, match="no path was found"):
                guard.move(b, 1.0, 0.0)
            continue
        assert guard.move(b, over_s, 0.0) == pytest.approx(over_s, rel=1e-12)
        assert over_s >= arm.duration_s(a, b) * (1.0 - 1e-12)
        q = stream(guard, over_s + TICK_S)
        p = arm.nose(q)
        assert np.all(p >= low) and np.all(p <= high)
        np.testing.assert_allclose(q[-1], b, atol=1e-12)
        assert np.max(np.abs(np.diff(q, axis=0))) <= SPEED_TOLERANCE * arm.joint_speed * TICK_S
        gone += 1
    assert gone > 2


def test_locked_joints_stay_on_roundabout_ways(made):
    """Three joints of five: the wrist may not help."""
    arm, safety = made("dof=3")
    low = replace(arm, box_high_m=(0.58, 0.45, 0.20))  # a ceiling, over which the straight ways bow
    five, locked, gone = unlocked(low), np.array(arm.home_rad[3:]), 0
    for a, b in pairs(low, 0, 5, free=False):
        guard = Guard(five, safety, joints=3)
        guard.begin(np.concatenate([a, locked]))
        try:
            over_s = guard.move(np.concatenate([b, locked]), 1.0, 0.0)
        except BadInput:
            continue
        q = stream(guard, over_s + TICK_S)
        np.testing.assert_allclose(q[:, 3:] - locked, 0.0, atol=1e-12)
        np.testing.assert_allclose(q[-1, :3], b, atol=1e-12)
        gone += 1
    assert gone > 2


def test_a_late_caller_makes_the_arm_late_and_a_clock_turned_back_loses_no_way(made):
    arm, safety = made("dof=3", heartbeat_timeout_s=60.0)
    guard, goal = stood(arm, safety), arm.home + SIDEWAYS
    guard.move(goal, 2.0, 0.0)
    before = stream(guard, 1.0)[-1]
    late = guard.set_point(8.0)  # 7 s too late
    assert 0.0 < np.max(np.abs(late - before)) <= arm.joint_speed * safety.step_s
    np.testing.assert_array_equal(guard.set_point(2.0), late)
    rest = stream(guard, 2.0 + 2.0 - 1.0 - safety.step_s, 2.0)  # what was left of the way
    np.testing.assert_allclose(rest[-1], goal, atol=1e-6)
    assert np.max(np.abs(rest[-3] - goal)) > 1e-9 and np.all(np.diff(rest[:, 0]) >= 0.0)


def test_commands_that_nobody_asked_a_set_point_for_take_the_arm_no_farther(made):
    """However many: a step is measured from the last set-point that was given."""
    arm, safety = made("dof=3")
    guard = stood(arm, safety)
    guard.move(arm.home + SIDEWAYS, 1.0, 0.0)
    before = stream(guard, 0.5)[-1]
    for t_s in np.arange(0.54, 0.8, 0.04):
        with pytest.raises(BadInput, match="no path was found"):
            guard.move(FOLDED, 1.0, t_s)
    guard.move(arm.home, 1.0, 0.8)
    assert 0.0 < np.max(np.abs(guard.set_point(0.8) - before)) <= SPEED_TOLERANCE * arm.joint_speed * safety.step_s


def test_silence_is_noticed_though_the_clock_was_turned_back(made):
    arm, safety = made("dof=3")
    guard = stood(arm, safety)
    stream(guard, 100.0, 99.0)
    guard.move(arm.home + SIDEWAYS, 10.0, 100.0)
    for t_s in np.arange(20.0, 20.5 + safety.heartbeat_timeout_s + safety.sample_s, 0.1):
        guard.heartbeat(t_s, HOST)
        guard.set_point(t_s)
    assert "the nose was silent" in guard.held


@pytest.mark.parametrize(
    ("hold", "why"),
    [
        (lambda g, t: g.stop("somebody pressed the button"), "somebody pressed the button"),
        (lambda g, t: [g.report_load(t + 0.1 * i, np.array([0.0, -1.0, 0.0])) for i in range(20)], "shoulder_elevation had more than 60 %"),
        (lambda g, t: g.report_load(t, np.zeros(3), np.array([20.0, 30.0, 61.0])), "elbow_tilt is 61 degC hot, and 60 are allowed"),
        (lambda g, t: g.report_load(t, np.full(3, np.nan), np.array([np.nan, 61.0, 20.0])), "shoulder_elevation is 61 degC hot"),
        (lambda g, t: [(g.heartbeat(s, NOSE), g.set_point(s)) for s in np.arange(t, t + 3.0, 0.1)], r"the host was silent for 2\.[01] s"),
        (lambda g, t: [(g.heartbeat(s, HOST), g.set_point(s)) for s in np.arange(t, t + 3.0, 0.1)], r"the nose was silent for 2\.[12] s"),
    ],
)
def test_once_held_it_is_held_until_it_begins_anew(made, hold, why):
    arm, safety = made("dof=3", sample_s=0.1)
    guard = stood(arm, safety)
    guard.move(arm.home + SIDEWAYS, 10.0, 0.0)
    stream(guard, 1.0)
    assert guard.held is None and not guard.arrived
    hold(guard, 1.0)
    where = guard.set_point(4.0)
    assert where.tolist() == stream(guard, 9.0, 5.0)[-1].tolist() and np.any(where != arm.home)
    with pytest.raises(OioError, match=f"the arm is held where it is: .*{why}.*until it begins anew") as raised:
        guard.move(arm.home, 1.0, 9.0)
    assert not isinstance(raised.value, BadInput)
    guard.stop("something else")
    assert "else" not in guard.held
    guard.begin(where)
    guard.move(arm.home, 1.0, 9.0)
    np.testing.assert_allclose(stream(guard, 10.1, 9.0)[-1], arm.home, atol=1e-12)


def test_an_arm_at_rest_waits_for_whoever_thinks(made):
    """A map may take the host a minute; only a moving arm needs to be watched."""
    arm, safety = made("dof=3")
    guard = stood(arm, safety)
    for t_s in np.arange(0.0, 60.0, 0.1):
        guard.heartbeat(t_s, NOSE)
        guard.set_point(t_s)
    guard.move(arm.home + SIDEWAYS, 2.0, 60.0)  # a sign of life
    guard.set_point(60.0)
    stream(guard, 62.1, 60.0)
    assert guard.held is None and guard.arrived


def test_a_stall_holds_in_the_time_told_and_the_load_of_moving_never(made):
    arm, safety = made("dof=3")
    for load, holds_s in ((1.0, safety.load_s), (-1.0, safety.load_s), (0.8, 2.0 * safety.load_s), (safety.load, np.inf), (np.nan, np.inf)):
        guard, felt_s = stood(arm, safety), 0.0
        while guard.held is None and felt_s < 60.0:
            guard.report_load(felt_s, np.array([0.0, load, 0.0]))
            felt_s += 0.01
        assert felt_s == pytest.approx(min(holds_s, 60.0), abs=0.03)
    swinging = stood(arm, safety)
    for i in range(6000):  # 0.9 for half a second, then nothing
        swinging.report_load(0.01 * i, np.full(3, 0.9 if i % 100 < 50 else 0.0), np.full(3, np.nan))
    assert swinging.held is None
    swinging.report_load(1e4, np.ones(3))  # nothing is known of the hours before
    assert swinging.held is None


@pytest.mark.parametrize("wrong", [np.zeros(2), np.zeros((3, 1)), 0.5])
def test_loads_and_temperatures_of_another_length_are_refused(made, wrong):
    guard = stood(*made("dof=3"))
    with pytest.raises(BadInput, match=r"loads of shape .* were felt, but 3 joints have one each"):
        guard.report_load(0.0, wrong)
    with pytest.raises(BadInput, match="temperatures of shape"):
        guard.report_load(0.0, np.zeros(3), wrong)


def test_it_moves_only_once_it_has_begun_and_not_from_anywhere(made):
    arm, safety = made("dof=3")
    guard = Guard(arm, safety)
    with pytest.raises(OioError, match="it has not begun"):
        guard.move(arm.home, 1.0, 0.0)
    for q, said in (([0.3, -0.7, 0.9], "the nose from"), ([np.nan] * 3, "finite number"), ([0.0], r"dof=3 takes \(3,\)")):
        with pytest.raises(BadInput, match=said):
            guard.begin(np.array(q))
    five, limits = made("dof=5")
    with pytest.raises(BadInput, match="joints may go from"):  # the nose is where it is at home
        Guard(five, limits).begin(np.array([*five.home[:4], 3.0]))
    with pytest.raises(BadInput, match="a heartbeat of 'cat' was given, but a guard expects those of host and nose"):
        guard.heartbeat(0.0, "cat")


def test_what_is_handed_out_and_in_is_nobody_elses(made):
    arm, safety = made("dof=3")
    guard, goal = stood(arm, safety), arm.home + 0.1
    guard.set_point(0.0)[:] = 9.0
    guard.move(goal, 1.0, 0.0)
    goal[:] = 9.0
    guard.set_point(0.02)[:] = 9.0
    np.testing.assert_allclose(stream(guard, 1.2, 0.02)[-1], arm.home + 0.1, atol=1e-12)


def test_a_set_point_is_quick_enough_for_a_bus(made):
    arm, safety = made("dof=5")
    guard = stood(arm, safety)
    guard.move(arm.home + 0.1, 100.0, 0.0)
    best_s = np.inf
    for batch in range(20):
        began = time.perf_counter()
        for k in range(100):
            heard(guard, batch + 0.01 * k)
        best_s = min(best_s, (time.perf_counter() - began) / 100)
    assert best_s < 100e-6


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("box_margin_m", 0.1),
        ("step_s", 0.0),
        ("command_age_s", -1.0),
        ("heartbeat_timeout_s", 0.0),
        ("load", 1.5),
        ("load_s", 0.0),
        ("temperature_degc", 500.0),
    ],
)
def test_limits_that_hold_nothing_back_are_refused(made, key, value):
    with pytest.raises(BadInput, match=f"SafetyLimits.{key} is {value:g}, but"):
        made("dof=3", **{key: value})
