"""An arm over an emulated bus: what it refuses, what stops it, how it is left; and the buses of two makers alike."""

import threading
import time
from itertools import pairwise

import numpy as np
import pytest

from hardware.drivers.arm_port import ArmPort
from hardware.drivers.arms.fixed_mount import FixedMount
from hardware.drivers.arms.jitter import Jitter
from hardware.drivers.arms.tracking_error import TrackingErrorMonitor
from hardware.drivers.robots.lerobot_options import LerobotOptions
from hardware.drivers.robots.ros2_options import Ros2Options
from hardware.drivers.servos.bus import ServoHealth, ServoState
from hardware.drivers.servos.buses import BUSES
from hardware.transport.mailbox import Mailbox
from hardware.transport.port import NoAnswer
from oio.core.errors import BadInput, OioError
from oio.core.records import SECOND_NS, nanoseconds
from oio.gas.source import unlocked
from oio.kinematics.finite_differences import FiniteDifferences
from tests.hardware.drivers.stepped_clock import Stepped


class Servos:
    """A bus without a wire: servos go where they are sent at once. Stands for any maker's."""

    name, baud, counts_per_turn, middle = "fake", 1, 4096, 2048

    def __init__(self, counts):
        self.counts, self.on, self.told = np.array(counts), None, []
        self.load, self.temperature, self.missing, self.stuck = np.zeros(len(counts)), 30.0, set(), False
        self.fault, self.deaf = None, False
        self.good = self.corrupt = self.skipped = 0

    def framer(self):
        return self

    def ping(self, wire, servo):
        return None if servo in self.missing else "fake"

    def configure(self, wire, ids):
        pass

    def read_state(self, wire, ids):
        self.clock.sleep(0.001)
        if self.missing:
            raise NoAnswer("servo does not answer")
        return ServoState(self.counts.copy(), self.load.copy(), self.fault)

    def write_goals(self, wire, ids, counts):
        if self.deaf:
            return
        self.told.append(counts.copy())
        if not self.stuck:
            self.counts = counts.copy()

    def torque(self, wire, ids, on):
        self.on = on

    def health(self, wire, servo):
        goal = self.told[-1][servo - 1] if self.told else 1000
        return ServoHealth(self.on is True, int(goal), 7.4, self.temperature)


ROUND = np.array([1.0, 0.0, 0.0, 0.0, 0.0])  # about the base: the nose keeps its height


PORT = {
    "driver": "feetech", "port": "/dev/null", "period_s": 0.008, "tracking_error_deg": 10.0, "tracking_error_s": 0.2,
    "home_s": 3.0, "hands_off_deg": 5.73, "hands_off_s": 3.0, "moved_by_hand_deg": 5.0, "health_every": 20, "fault_cycles": 20,
    "torque_off_at_end": False, "joint_names": None, "lerobot": LerobotOptions(type=None, id=None, options={}),
    "ros2": Ros2Options(states="/joint_states", message="trajectory", lead_periods=3.0, full_effort=None),
}  # fmt: skip


@pytest.fixture
def made(built, monkeypatch):
    """made(pose offset [rad], **port) gives (driver, bus, arm)."""

    def make(off=0.0, dof=5, **port):
        arm, safety = built("arm", f"dof={dof}"), built("safety")
        home = unlocked(arm).home + off
        bus = Servos(np.rint(2048 + home * 4096 / (2 * np.pi)).astype(int))
        bus.clock = clock = Stepped()
        monkeypatch.setitem(BUSES, "feetech", lambda: bus)
        monkeypatch.setattr("hardware.drivers.arms.arm_driver.time", clock)
        return ArmPort(**(PORT | port)).live(arm, safety, Mailbox(10**6), clock), bus, arm

    return make


def turns(driver, seconds, alive=True):
    """Let the driver's thread work for so many seconds of the world."""
    end_ns = driver._clock.now_ns() + nanoseconds(seconds)
    while driver._clock.now_ns() < end_ns:
        driver._mailbox.gas_ns = driver._clock.now_ns()
        if alive:
            driver.heartbeat()
        driver.poll(None)


def radians(counts):
    return (counts - 2048) * 2 * np.pi / 4096


def test_it_holds_where_it_stands_before_it_gets_torque(made):
    driver, bus, _ = made(off=0.1)
    before = bus.counts.copy()
    driver.configure(None)
    assert bus.on is True and np.array_equal(bus.told[0], before) and len(bus.told) == 1


def test_no_torque_before_every_servo_has_its_new_goal(made):
    """A goal that was lost on the wire leaves an old one, to which the arm would jump at full speed."""
    driver, bus, _ = made()
    bus.deaf = True
    with pytest.raises(NoAnswer, match=r"servo 1 was given the goal \d+, but has 1000"):
        driver.configure(None)
    assert bus.on is None
    bus.deaf = False
    driver.configure(None)
    assert bus.on is True


def test_a_servo_that_lets_go_by_itself_stops_the_others(made):
    """As after a supply that failed for a moment: it answers again, and is limp."""
    driver, bus, _ = made()
    driver.configure(None)
    turns(driver, 2.0)
    assert driver.held is None and driver.health_summary == "7.4 V, 30 degC"
    bus.on = False
    turns(driver, 2.0)
    assert "has let go" in driver.held


@pytest.mark.parametrize("dof", [1, 3, 5])
def test_a_move_arrives_smoothly_and_locked_joints_stay_home(made, dof):
    driver, bus, arm = made(dof=dof)
    driver.configure(None)
    goal = arm.home + 0.2 * ROUND[:dof]
    lasts_s = driver.move(goal, 1.0)
    turns(driver, lasts_s + 0.5)
    q = np.array([radians(c) for c in bus.told])
    assert np.max(np.abs(q[-1][:dof] - goal)) < 2e-3 and (dof == 5 or np.all(np.ptp(q[:, dof:], axis=0) == 0.0))
    assert np.max(np.abs(np.diff(q, axis=0))) <= arm.joint_speed * 0.05 * 1.02 + 2 * np.pi / 4096
    joints = [a.sample for a in driver._mailbox.joints]
    assert len(joints) > 50 and {len(j.q) for j in joints} == {dof} and all(a.t_ns < b.t_ns for a, b in pairwise(joints))


def test_the_guard_accounts_for_the_set_points_and_the_loads_of_the_servos(made):
    driver, bus, arm = made(dof=3)
    driver.configure(None)
    bus.load[4] = np.nan
    turns(driver, driver.move(arm.home + 0.2 * ROUND[:3], 1.0) + 0.5)
    account = driver.guard_account()
    q = np.array([radians(c) for c in bus.told])
    leaps_m = np.linalg.norm(np.diff(unlocked(arm).nose(q), axis=0), axis=1)
    assert account.top_speed_m_s == pytest.approx(np.max(np.convolve(leaps_m, np.ones(8), "valid")) / (8 * 0.008), rel=0.15)
    assert account.load_unwatched == (arm.all_names[4],) and account.without_limit == ()


def test_an_arm_that_stands_where_it_may_not_be_gets_no_torque(made):
    driver, bus, _ = made(off=np.array([0.0, 1.4, 0.9, 0.6, 0.0]))
    with pytest.raises(OioError, match=r"the arm stands at .* degrees.*not switched on.*by hand near its home"):
        driver.configure(None)
    assert bus.on is None and bus.told == []


def test_a_servo_that_does_not_answer_is_named(made):
    driver, bus, _ = made()
    bus.missing = {3}
    with pytest.raises(NoAnswer, match="servo 3 of 5"):
        driver.configure(None)


@pytest.mark.parametrize(
    "broken, why",
    [
        ("stuck", "from where it was led"),
        ("load", "torque"),
        ("temperature", "degC hot"),
        ("fault", "servo 2 reports overload"),
        ("clock", "suspended"),
    ],
)
def test_what_must_stop_an_arm_stops_it_for_good(made, broken, why):
    driver, bus, arm = made()
    driver.configure(None)
    lasts_s = driver.move(arm.home + 0.9 * ROUND, 3.0)
    if broken == "clock":
        turns(driver, 0.5)
        bus.clock.suspended_s = 1.1
    else:
        setattr(bus, broken, {"stuck": True, "load": np.ones(5), "temperature": 80.0, "fault": "servo 2 reports overload"}[broken])
    turns(driver, lasts_s + 3.0)
    assert why in driver.held
    still = bus.told[-1]
    turns(driver, 0.5)
    assert np.array_equal(bus.told[-1], still) and np.max(np.abs(radians(still)[:1] - arm.home[:1] - 0.9)) > 0.01
    with pytest.raises(OioError):
        driver.move(arm.home, 1.0)
    driver.configure(None)  # its plug was pulled and put back
    assert driver.held is not None


def test_an_arm_that_met_something_does_not_go_on_pressing(made):
    driver, bus, arm = made()
    driver.configure(None)
    met = bus.counts.copy()
    bus.stuck = True
    turns(driver, driver.move(arm.home + 0.9 * ROUND, 3.0) + 1.0)
    assert "something is in its way" in driver.held and np.array_equal(bus.told[-1], met)


def test_an_arm_that_stalls_a_little_outside_its_limits_does_not_press_on_either(made):
    """Homing is not exact: what the stop allows may lie beyond what the MJCF does."""
    driver, bus, arm = made()
    driver.configure(None)
    bus.stuck = True
    beyond = arm.high_rad[0] + np.radians(1.0)
    goal = unlocked(arm).home.copy()
    goal[0] = beyond
    bus.counts = np.rint(2048 + goal * 4096 / (2 * np.pi)).astype(int)
    turns(driver, 1.0)
    assert "something is in its way" in driver.held
    assert radians(bus.told[-1][0]) == pytest.approx(arm.high_rad[0], abs=2 * np.pi / 4096)


def test_a_held_arm_that_was_moved_by_hand_is_held_where_it_is_then(made):
    """Its supply was cut meanwhile: with the old goal it would jump there at full speed."""
    driver, bus, _ = made()
    driver.configure(None)
    driver.stop("a test")
    bus.counts = bus.counts + np.array([300, 0, 0, 0, 0])
    moved, bus.on = bus.counts.copy(), False
    driver.configure(None)
    assert bus.on is True and np.array_equal(bus.told[-1], moved) and driver.held == "a test"
    bus.counts, bus.on = bus.counts + np.array([0, 900, 600, 400, 0]), False
    with pytest.raises(OioError, match="not switched on"):
        driver.configure(None)
    assert bus.on is False


def test_how_far_from_home_it_was_found(made):
    for off in (0.0, 0.2):
        driver, _, _ = made(off=off * ROUND)
        driver.configure(None)
        assert driver.distance_from_home_rad == pytest.approx(off, abs=2 * np.pi / 4096)


def test_one_complaint_is_no_reason_to_stop(made):
    driver, bus, _ = made()
    driver.configure(None)
    for complaint in ("servo 1 reports a wrong voltage", None):
        bus.fault = complaint
        turns(driver, 0.1)
    assert driver.held is None


def test_a_host_that_falls_silent_stops_a_moving_arm_and_no_standing_one(made):
    driver, _, arm = made()
    driver.configure(None)
    turns(driver, 4.0, alive=False)
    assert driver.held is None
    driver.move(arm.home + 0.3 * ROUND, 4.0)
    turns(driver, 4.0, alive=False)
    assert "host was silent" in driver.held


@pytest.mark.parametrize("release", [False, True])
def test_at_the_end_it_stops_and_lets_go_only_if_asked(made, release):
    driver, bus, arm = made(torque_off_at_end=release)
    driver.configure(None)
    driver.move(arm.home + 0.3 * ROUND, 4.0)
    turns(driver, 1.0)
    driver.release(None)
    assert bus.on is (not release) and np.max(np.abs(radians(bus.told[-1]) - unlocked(arm).home - 0.3 * ROUND)) > 0.05


def test_moves_come_from_another_thread_than_turns(made):
    driver, _, arm = made()
    driver.configure(None)
    over, errors = threading.Event(), []

    def lead():
        try:
            while not over.is_set():
                turns(driver, 0.2)
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=lead)
    thread.start()
    rng = np.random.default_rng(0)
    for _ in range(50):
        driver.move(arm.home + rng.uniform(-0.1, 0.1, 5), 0.2)
        time.sleep(0.002)
    over.set()
    thread.join()
    assert not errors and driver.held is None


def test_standing_joints_come_in_their_rhythm_and_only_home_is_a_goal(built):
    standing = FixedMount(built("arm"), 0.01)
    states = standing.until(nanoseconds(0.1)) + standing.until(nanoseconds(0.2))
    assert [s.t_ns for s in states] == [round(i * 1e7) for i in range(21)] and all(np.all(s.q == built("arm").home) for s in states)
    assert standing.move(built("arm").home, 1.0) == 1.0
    with pytest.raises(BadInput, match=r"backend\.arm\.driver=none has no arm"):
        standing.move(built("arm").home + 0.1, 1.0)


def test_velocity_and_acceleration_are_differences():
    made = FiniteDifferences()
    states = [made.state(i * SECOND_NS // 100, np.array([0.5 * 3.0 * (i / 100) ** 2])) for i in range(10)]
    assert states[-1].dq[0] == pytest.approx(3.0 * 0.085, rel=1e-6) and states[-1].ddq[0] == pytest.approx(3.0, rel=1e-6)


def test_rhythm_is_mean_spread_and_longest():
    rhythm, periods = Jitter(), np.array([10, 12, 8, 30, 10]) * 1_000_000
    for t_ns in np.concatenate([[0], np.cumsum(periods)]):
        rhythm.beat(int(t_ns))
    assert rhythm.hz == pytest.approx(1e9 / np.mean(periods)) and rhythm.jitter_s == pytest.approx(np.std(periods, ddof=1) * 1e-9)
    assert rhythm.longest_s == pytest.approx(0.03) and "Hz, jitter" in str(rhythm)


def test_astray_is_far_and_for_long():
    astray, home = TrackingErrorMonitor(("a", "b"), 10.0, 1.0), np.zeros(2)
    far = np.array([0.0, 0.3])
    assert astray.check(0.0, far, home) is None and astray.check(0.9, far, home) is None
    assert astray.check(0.95, home, home) is None and astray.check(1.9, far, home) is None  # it came back: counted anew
    assert "joint b is 17 degrees" in astray.check(3.0, far, home)


@pytest.mark.parametrize(
    "given, words",
    [
        ({"driver": "ax12"}, "feetech, dynamixel, python, lerobot, ros2, none"),
        ({"port": None}, r"has no port.*hardware\.ports"),
        ({"period_s": 1.0}, "0.005 to 0.1"),
    ],
)
def test_ports_of_arms_that_make_no_sense_are_refused(given, words):
    with pytest.raises(BadInput, match=words):
        ArmPort(**(PORT | given))
