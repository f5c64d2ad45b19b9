"""What a guard accounts for: limits, the top speed of the set-points it gave, and loads that it heard; the same by the log."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from oio.motion.guard import HOST, NOSE, Guard
from oio.motion.guard_account import CommandedTrack, GuardAccount, without_limit

TICK_S = 0.02


@pytest.fixture
def moved(built):
    """A guard that has moved its arm there and back, told of loads or not."""

    def make(loads=True, **safety):
        arm = built("arm", "dof=3")
        guard = Guard(arm, replace(built("safety"), **safety), TICK_S)
        guard.begin(arm.home)
        t_s = 0.0
        for goal in (arm.home + np.array([0.6, 0.0, 0.0]), arm.home):
            until_s = t_s + guard.move(goal, 0.1, t_s)
            while t_s < until_s:
                t_s += TICK_S
                guard.heartbeat(t_s, HOST)
                guard.heartbeat(t_s, NOSE)
                guard.set_point(t_s)
                if loads:
                    guard.report_load(t_s, np.array([0.1, np.nan if t_s > 0.5 else 0.1, 0.1]))
        return arm, guard

    return make


def test_an_arm_that_is_guarded_has_all_limits_and_keeps_its_speed(moved):
    arm, guard = moved()
    account = guard.account()
    assert account.without_limit == account.load_unwatched == ()
    assert account.speed_limit_m_s == arm.nose_limit_m_s
    assert 0.5 * arm.nose_speed_m_s < account.top_speed_m_s <= 1.01 * arm.nose_limit_m_s


def test_a_joint_of_which_no_load_was_heard_is_not_watched(moved):
    arm, guard = moved(loads=False)
    assert guard.account().load_unwatched == arm.names
    guard.report_load(9.0, np.array([0.1, np.nan, 0.1]))
    assert guard.account().load_unwatched == (arm.names[1],)


def test_a_limit_of_load_that_nothing_can_exceed_is_none(moved):
    arm, guard = moved(load=1.0)
    assert guard.account().load_unwatched == arm.names


def test_limits_that_are_not_finite_are_named(built):
    arm = built("arm", "dof=3")
    low, high = np.array(arm.low_rad), np.array(arm.high_rad)
    low[1] = -np.inf
    loose = SimpleNamespace(
        names=arm.names, low_rad=low, high_rad=high, box_low_m=arm.box_low_m, box_high_m=(np.inf, 1.0, 1.0), joint_speed=np.nan,
        nose_limit_m_s=0.8,
    )  # fmt: skip
    assert without_limit(loose) == (arm.names[1], "arm.box_high_m", "arm.joint_speed")


def test_the_top_speed_is_that_of_the_set_points(built):
    """Whatever their number, and whether it is asked for between; a late host's arm is not fast, and a new beginning is no leap."""
    arm = built("arm", "dof=3")
    pan = np.array([1.0, 0.0, 0.0])
    radius_m = float(np.linalg.norm(arm.nose_jacobian(arm.home)[1] @ pan))
    track, often = CommandedTrack(arm), CommandedTrack(arm)
    for i in range(300):
        for t in (track, often):
            t.add(0.02 * i, arm.home + 1e-3 * i * pan)
        assert often.top_speed_m_s <= 1.001 * 0.05 * radius_m
    assert track.top_speed_m_s == pytest.approx(0.05 * radius_m, rel=1e-3)
    assert often.top_speed_m_s == track.top_speed_m_s
    track.add(60.0, arm.home + pan)  # 54 s later
    track.restart()
    track.add(60.01, arm.home)
    track.add(60.0, arm.home + 0.1 * pan)  # a clock that ran backwards: the arm gets no other
    assert track.top_speed_m_s == often.top_speed_m_s


def test_the_log_gives_the_same_account_to_the_last_bit():
    account = GuardAccount(("pan",), 0.1 + 0.2, 0.8, ("tilt", "roll"))
    assert GuardAccount.from_json(account.to_json()) == account


@pytest.mark.parametrize("text", ["", "3", "{}", "[" * 5000, '{"without_limit": 3}', '{"without_limit": [], "load_unwatched": []}'])
def test_a_text_that_is_no_account_gives_none(text):
    assert GuardAccount.from_json(text) is None
