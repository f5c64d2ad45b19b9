"""Arms that a Python object of the user's commands: what it is asked for, what is refused, and what stops it."""

import sys
import threading
import time
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from hardware.drivers.robots.python_robot import PythonRobot
from hardware.drivers.robots.reading_monitors import JumpMonitor, StaleMonitor
from hardware.drivers.robots.robot_arm import RobotArm, RobotOpener
from hardware.drivers.robots.watched_robot import WatchedRobot
from hardware.transport.clock import Clock
from hardware.transport.device import Device
from hardware.transport.driver import Timeouts
from hardware.transport.mailbox import Mailbox
from hardware.transport.port import DeviceLost, NoAnswer
from oio.core.errors import BadInput, OioError
from oio.core.records import nanoseconds, seconds
from oio.gas.source import unlocked
from tests.hardware.drivers.stepped_clock import Stepped

PERIOD_S = 0.008
TIMEOUTS = Timeouts(connect_s=0.3, receive_s=0.1, reconnect_s=0.2, backoff_s=0.02, backoff_max_s=0.1)
ROUND = np.array([1.0, 0.0, 0.0, 0.0, 0.0])  # about the base: the nose keeps its height


class Lagging:
    """What a user would write: joints that follow with a lag of first order. `broken` is one of the faults."""

    LAG_S = 0.03

    def __init__(self, clock, home):
        self.clock, self.q, self.goal, self.told, self.closed, self.broken, self.load = clock, home.copy(), home.copy(), [], 0, None, 0.1
        self._last_s, self._stale, self.blocked = 0.0, None, None

    def __call__(self):
        return self

    def _advance(self):
        now_s = seconds(self.clock.now_ns())
        self.q = self.goal + (self.q - self.goal) * np.exp(-(now_s - self._last_s) / self.LAG_S)
        self._last_s = now_s

    def read(self):
        self.clock.sleep(0.001)
        self._advance()
        if self.broken == "raises":
            raise ValueError("the encoder of joint 3 says 0xFF")
        if self.broken == "link":
            raise ConnectionError("no answer from 10.0.0.7")
        if self.broken == "stale":
            self._stale = self.q.copy() if self._stale is None else self._stale
            return self._stale
        if self.broken == "blocked":  # by something soft, so that its encoders go on
            self.blocked = self.q.copy() if self.blocked is None else self.blocked + 1e-6
            return self.blocked
        return {"jumps": self.q + 0.9 * ROUND, "short": self.q[:3], "nan": self.q * np.nan, "words": "up"}.get(self.broken, self.q)

    def write(self, positions):
        self._advance()
        if self.broken == "deaf":
            raise RuntimeError("safeguard stop")
        self.goal = np.array(positions)
        self.told.append(self.goal)
        positions[:] = np.nan  # what the user does with the array is the user's affair

    def effort(self):
        return np.full(5, self.load)

    def describe(self):
        return "lab arm 7,\n firmware 5.1"

    def close(self):
        self.closed += 1
        raise RuntimeError("whatever a close may raise")


@pytest.fixture
def made(built, monkeypatch):
    """made(dof) gives (driver, robot, the user's object, arm); the object is my_arm:Arm."""

    def make(dof=5, off=0.0):
        arm, clock = built("arm", f"dof={dof}"), Stepped()
        user = Lagging(clock, unlocked(arm).home + off)
        monkeypatch.setitem(sys.modules, "my_arm", SimpleNamespace(Arm=user))
        monkeypatch.setattr("hardware.drivers.arms.arm_driver.time", clock)
        words = ["backend=serial", "backend.nose.driver=line", "backend.nose.port=none", "backend.arm.port=my_arm:Arm"]
        port = built("backend.arm", *words, "backend.arm.driver=python", "backend.arm.tracking_error_s=0.2")
        driver = port.live(arm, built("safety"), Mailbox(10**6), clock)
        assert isinstance(driver, RobotArm)
        return driver, port.opener(driver).open(), user, arm

    return make


def turns(driver, robot, seconds_):
    """Let the driver's thread work for so many seconds of the world."""
    end_ns = driver._clock.now_ns() + nanoseconds(seconds_)
    while driver._clock.now_ns() < end_ns:
        driver._mailbox.gas_ns = driver._clock.now_ns()
        driver.heartbeat()
        driver.poll(robot)


@pytest.mark.parametrize("dof", [1, 3, 5])
def test_an_object_with_three_methods_is_led_like_any_arm(made, dof):
    driver, robot, user, arm = made(dof)
    before = user.q.copy()
    assert driver.configure(robot) == "lab arm 7, firmware 5.1"
    assert np.allclose(user.told[0], before) and len(user.told) == 1  # it holds where it stands
    goal = arm.home + 0.2 * ROUND[:dof]
    turns(driver, robot, driver.move(goal, 1.0) + 0.5)
    q = np.array(user.told)
    assert np.allclose(user.q[:dof], goal, atol=1e-3) and np.all(np.ptp(q[:, dof:], axis=0) == 0.0)  # locked joints stay home
    assert np.max(np.abs(np.diff(q, axis=0))) <= arm.joint_speed * 0.05 * 1.02
    states = [stamped.sample for stamped in driver._mailbox.joints]
    assert len(states) > 100 and {len(state.q) for state in states} == {dof}
    assert driver.held is None and driver.health_summary == "load at most 10 %" and driver.counts()["rounds"] == len(states)
    assert driver.guard_account().load_unwatched == () and driver.guard_account().top_speed_m_s > 0.01
    robot.close()
    assert user.closed == 1


def test_the_pose_it_is_found_in_is_judged_as_that_of_any_arm(made):
    driver, robot, user, _ = made(off=np.array([0.0, 1.4, 0.9, 0.6, 0.0]))
    with pytest.raises(OioError, match=r"the arm stands at .* degrees.*not switched on.*not those of the model"):
        driver.configure(robot)
    assert user.told == []


def test_degrees_are_recognised(made):
    driver, robot, user, _ = made()
    user.q = user.goal = np.degrees(user.q)
    with pytest.raises(BadInput, match=r"but may as degrees: give radians"):
        driver.configure(robot)
    assert user.told == []


@pytest.mark.parametrize(
    "broken, why",
    [
        ("raises", r"my_arm:Arm: read\(\) raised ValueError: the encoder of joint 3 says 0xFF \(test_robots.py, line \d+\)\."),
        ("deaf", r"write\(\) raised RuntimeError: safeguard stop"),
        ("short", r"read\(\) gave 3 numbers, but the arm has 5 joints: shoulder_azimuth, "),
        ("nan", r"read\(\) gave nan for joint shoulder_azimuth"),
        ("words", r"read\(\) gave up, but 5 numbers are wanted"),
    ],
)
def test_what_the_object_does_wrong_holds_the_arm_and_is_said_in_its_words(made, broken, why):
    driver, robot, user, arm = made()
    driver.configure(robot)
    driver.move(arm.home + 0.9 * ROUND, 3.0)
    turns(driver, robot, 0.5)
    user.broken = broken
    with pytest.raises(OioError, match=why):
        turns(driver, robot, 0.5)
    user.broken = None
    still = user.told[-1]
    driver.release(robot)
    assert np.allclose(user.told[-1], still, atol=0.02) and driver.held is not None
    with pytest.raises(OioError):
        driver.move(arm.home, 1.0)


def test_a_link_that_fails_for_a_moment_is_counted_and_the_arm_goes_on(made):
    driver, robot, user, arm = made()
    driver.configure(robot)
    lasts_s = driver.move(arm.home + 0.2 * ROUND, 1.0)
    turns(driver, robot, 0.3)
    user.broken = "link"
    with pytest.raises(NoAnswer, match=r"read\(\) raised ConnectionError: no answer from 10\.0\.0\.7"):
        turns(driver, robot, 0.3)
    user.broken = None
    turns(driver, robot, lasts_s)
    assert driver.held is None and driver.counts()["lost"] == 1 and np.allclose(user.q, unlocked(arm).home + 0.2 * ROUND, atol=1e-3)


def test_a_jump_is_none_of_the_arms_and_is_neither_logged_nor_held(made):
    driver, robot, user, arm = made()
    driver.configure(robot)
    driver.move(arm.home + 0.3 * ROUND, 3.0)
    turns(driver, robot, 0.5)
    logged, told = len(driver._mailbox.joints), user.told[-1]
    user.broken = "jumps"
    turns(driver, robot, 2 * PERIOD_S)
    assert "joint shoulder_azimuth jumped by 5" in driver.held
    turns(driver, robot, 1.0)
    assert np.allclose(user.told[-1], told, atol=0.02) and len(driver._mailbox.joints) >= logged
    jumped = [s.sample.q[0] for s in list(driver._mailbox.joints)[logged : logged + 1]]
    assert not jumped or abs(jumped[0] - told[0]) > 0  # the reading of the jump itself is left out; later ones are as they are


def test_stale_positions_stop_the_arm_where_it_was_led(made):
    driver, robot, user, arm = made()
    driver.configure(robot)
    lasts_s = driver.move(arm.home + 0.9 * ROUND, 3.0)
    turns(driver, robot, 0.3)
    user.broken = "stale"
    turns(driver, robot, lasts_s)
    assert "the joints have said the same for 0.3 s" in driver.held
    steps = np.abs(np.diff(np.array(user.told), axis=0))
    assert np.max(steps) <= arm.joint_speed * 0.05 * 1.02 and user.told[-1][0] - arm.home[0] > 0.02


def test_an_arm_that_met_something_is_led_back_no_faster_than_it_goes(made):
    driver, robot, user, arm = made()
    driver.configure(robot)
    lasts_s = driver.move(arm.home + 0.9 * ROUND, 3.0)
    turns(driver, robot, 0.3)
    user.broken = "blocked"
    turns(driver, robot, lasts_s)
    assert "something is in its way" in driver.held and abs(user.told[-1][0] - user.blocked[0]) < 0.02
    assert np.max(np.abs(np.diff(np.array(user.told), axis=0))) <= arm.joint_speed * 0.05 * 1.02


def test_effort_above_the_limit_stops_it(made):
    driver, robot, user, _ = made()
    driver.configure(robot)
    user.load = 1.0
    turns(driver, robot, 3.0)
    assert "of its torque for too long" in driver.held


# ---- what is refused before anything moves


NAMES = ("a", "b")


def user_module(monkeypatch, **members):
    module = ModuleType("theirs")
    vars(module).update(members)
    monkeypatch.setitem(sys.modules, "theirs", module)


class Two:
    """An arm of two joints."""

    def read(self):
        return [0.0, 0.0]

    def write(self, positions):
        pass

    def close(self):
        pass


def raising():
    raise ValueError("no such controller")


@pytest.mark.parametrize(
    "target, told",
    [
        ("theirs", r"backend\.arm\.port=theirs was given, but it must be package\.module:name\. Type e\.g\."),
        ("theirs:", "must be package.module:name"),
        ("../theirs:Arm", "must be package.module:name"),
        ("nowhere.at_all:Arm", r"there is no module nowhere in "),
        ("theirs:Leg", r"theirs has no Leg; it has Two, nothing, number, raising\."),
        ("theirs:nothing", r"is a NoneType without read\(\), write\(\), close\(\), but an arm needs read\(\) -> positions"),
        ("theirs:number", r"is a int without read\(\)"),
        ("theirs:raising", r"theirs:raising\(\) raised ValueError: no such controller \(test_robots\.py, line \d+\)"),
    ],
)
def test_what_is_no_arm_is_refused_in_one_paragraph(monkeypatch, target, told):
    user_module(monkeypatch, Two=Two, nothing=lambda: None, number=7, raising=raising)
    with pytest.raises(BadInput, match=told) as caught:
        RobotOpener(WatchedRobot(PythonRobot(target, NAMES), Clock(1.0)), target, "").open()
    assert "\n" not in str(caught.value)


def test_an_object_a_class_and_a_function_will_do(monkeypatch):
    user_module(monkeypatch, Two=Two, two=Two(), make=lambda: Two())
    for target in ("theirs:Two", "theirs:two", "theirs:make"):
        robot = PythonRobot(target, NAMES)
        robot.connect()
        assert robot.read().q.tolist() == [0.0, 0.0] and robot.describe() == f"Two of {target}"
        robot.close()
        robot.close()


def test_a_module_that_cannot_be_imported_says_why_and_where(tmp_path, monkeypatch):
    (tmp_path / "half_an_arm.py").write_text("import numpy\nspeed = 1 / 0\n", encoding="utf-8")
    (tmp_path / "needs_a_library.py").write_text("import ur_rtde_of_nobody\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    with pytest.raises(BadInput, match=r"cannot be imported: ZeroDivisionError: division by zero \(half_an_arm\.py, line 2\)"):
        PythonRobot("half_an_arm:Arm", NAMES)
    with pytest.raises(BadInput, match=r"cannot be imported: ModuleNotFoundError: No module named 'ur_rtde_of_nobody'"):
        PythonRobot("needs_a_library:Arm", NAMES)


def test_joints_jump_when_they_are_faster_than_led_and_lag():
    jumps = JumpMonitor(("a", "b"), 1.0, 10.0)
    assert jumps.check(0.0, np.array([5.0, 0.0])) is None  # the first may be anywhere
    assert jumps.check(0.1, np.array([5.0, 0.3])) is None
    assert "joint a jumped by 29 degrees within 10 ms" in jumps.check(0.11, np.array([5.5, 0.3]))
    jumps.restart()
    assert jumps.check(0.12, np.array([0.0, 0.0])) is None


def test_what_stays_the_same_is_stale_only_while_the_arm_is_led():
    stale, q = StaleMonitor(1.0), np.zeros(2)
    assert all(stale.check(0.1 * k, q, q) is None for k in range(50))  # it stands
    assert stale.check(5.1, q, q + 0.02) is None and "led by 3 degrees" in stale.check(5.2, q, q + 0.05)
    assert stale.check(5.3, q + 1e-9, q + 0.05) is None
    stale.restart()
    assert stale.check(9.0, q, q) is None


# ---- in a thread, in real time


class Failing(Lagging):
    """A link that is away for a while; counts its connections."""

    def __init__(self, clock, home):
        super().__init__(SimpleNamespace(now_ns=clock.now_ns, sleep=lambda s: None), home)
        self.connections, self.is_away = 0, False

    def __call__(self):
        if self.is_away:
            raise ConnectionRefusedError("nobody at 10.0.0.7")
        self.connections += 1
        return self

    def read(self):
        self.broken = "link" if self.is_away else None
        return super().read()


def until(what, within_s=10.0):
    end_s = time.monotonic() + within_s
    while not what() and time.monotonic() < end_s:
        time.sleep(0.01)
    assert what()


@pytest.fixture
def threaded(built, monkeypatch):
    """threaded() gives (device, driver, the user's object), running."""
    clock, arm = Clock(1.0), built("arm", "dof=3")
    user = Failing(clock, unlocked(arm).home)
    monkeypatch.setitem(sys.modules, "my_arm", SimpleNamespace(Arm=lambda: user()))
    words = ["backend=serial", "backend.nose.driver=line", "backend.nose.port=none", "backend.arm.port=my_arm:Arm"]
    port, box = built("backend.arm", *words, "backend.arm.driver=python"), Mailbox(10**6)
    driver = port.live(arm, built("safety"), box, clock)
    device = Device(port.opener(driver), driver, box, clock, Timeouts(**(vars(TIMEOUTS) | {"connect_s": 10.0, "reconnect_s": 2.0})))
    device.start()
    until(lambda: driver.counts()["rounds"] > 3 or device.error)
    yield device, driver, user
    device.stop()


def test_a_link_that_comes_back_is_connected_anew_and_the_arm_goes_on(threaded):
    device, driver, user = threaded
    assert device.identity == "lab arm 7, firmware 5.1" and user.connections == 1
    user.is_away = True
    until(lambda: device.lost)
    user.is_away, rounds = False, driver.counts()["rounds"]
    until(lambda: driver.counts()["rounds"] > rounds + 3)
    device.check()
    assert user.connections == 2 and user.closed >= 1 and driver.held is None and device.news[0][0] == "gap"


def test_a_link_that_stays_away_ends_the_run_with_its_own_words(threaded):
    device, _, user = threaded
    user.is_away = True
    until(lambda: device.error is not None)
    with pytest.raises(DeviceLost, match=r"did not answer for 2 s \(.*ConnectionRefusedError: nobody at 10\.0\.0\.7.*Look at what your"):
        device.check()


# ---- a call that never returns


@pytest.mark.parametrize("where", ["connect", "poll"])
def test_a_call_that_does_not_return_ends_the_run_and_is_not_waited_for(where):
    over = threading.Event()
    hang, clock = lambda: over.wait(20.0), Clock(1.0)
    hanging = SimpleNamespace(name="python", connect=hang if where == "connect" else lambda: None, read=hang, close=lambda: None)
    opener = RobotOpener(WatchedRobot(hanging, clock), "my_arm:Arm", "Look.")
    driver = SimpleNamespace(key="backend.arm", name="python", configure=lambda _: "arm", poll=lambda it: it.read(), release=lambda _: None)
    device = Device(opener, driver, Mailbox(9), clock, TIMEOUTS)
    device.start()
    began_s = time.monotonic()
    try:
        with pytest.raises(DeviceLost, match=r"backend\.arm\.driver=python at backend\.arm\.port=my_arm:Arm hangs: a call has not ret"):
            while time.monotonic() < began_s + 5.0:
                device.check()
                time.sleep(0.01)
        assert time.monotonic() - began_s > 0.25
        stopped_s = time.monotonic()
        device.stop()
        assert time.monotonic() - stopped_s < 3.0
    finally:
        over.set()
        device.join()
