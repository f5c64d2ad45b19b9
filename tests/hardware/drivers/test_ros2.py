"""An arm over ROS 2, against a stand-in of the calls of rclpy and of the messages that it uses (as Jazzy has them), not against ROS 2."""

import sys
import time
from dataclasses import dataclass, field
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from hardware.drivers.robots.robot_arm import RobotOpener
from hardware.drivers.robots.ros2_options import Ros2Options
from hardware.drivers.robots.ros2_robot import Ros2Robot
from hardware.drivers.robots.watched_robot import WatchedRobot
from hardware.transport.clock import Clock
from hardware.transport.port import NoAnswer
from oio.core.errors import BadInput, OioError

UR = ("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint")
COMMANDS = "/scaled_joint_trajectory_controller/joint_trajectory"


@dataclass
class JointTrajectoryPoint:
    positions: list = field(default_factory=list)
    time_from_start: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(sec=0, nanosec=0))


@dataclass
class JointTrajectory:
    joint_names: list = field(default_factory=list)
    points: list = field(default_factory=list)


@dataclass
class Float64MultiArray:
    data: list = field(default_factory=list)


class Graph:
    """What the other nodes are: joint states that wait to be taken, and messages that were sent."""

    def __init__(self):
        self.coming, self.sent, self.listeners, self.heard, self.live = [], [], 1, None, 0

    def say(self, names, position, stamp=(0, 0), effort=()):
        header = SimpleNamespace(stamp=SimpleNamespace(sec=stamp[0], nanosec=stamp[1]))
        self.coming.append(SimpleNamespace(header=header, name=list(names), position=list(position), effort=list(effort)))

    # rclpy

    def init(self, args, context, signal_handler_options):
        assert args == [] and signal_handler_options == "NO"  # else Ctrl-C is no more the run's
        self.live += 1

    def create_node(self, name, context):
        return self

    def create_subscription(self, kind, topic, callback, qos):
        assert (kind, topic, qos) == ("JointState", "/joint_states", ("depth 1", "best effort"))
        self.heard = callback

    def create_publisher(self, kind, topic, depth):
        assert topic == COMMANDS and depth == 1
        return SimpleNamespace(publish=self.sent.append, get_subscription_count=lambda: self.listeners)

    def spin_once(self, timeout_sec):
        if self.coming:
            self.heard(self.coming.pop(0))
        else:
            time.sleep(min(timeout_sec, 0.01))

    def destroy_node(self):
        self.live -= 1


@pytest.fixture
def graph(monkeypatch):
    there, executor = Graph(), SimpleNamespace(add_node=lambda node: None, shutdown=lambda: None)
    executor.spin_once = there.spin_once
    modules = {
        "rclpy": {"init": there.init, "create_node": there.create_node},
        "rclpy.context": {"Context": lambda: SimpleNamespace(try_shutdown=lambda: None)},
        "rclpy.signals": {"SignalHandlerOptions": SimpleNamespace(NO="NO")},
        "rclpy.executors": {"SingleThreadedExecutor": lambda context: executor},
        "rclpy.qos": {
            "QoSProfile": lambda depth, reliability: (f"depth {depth}", reliability),
            "ReliabilityPolicy": SimpleNamespace(BEST_EFFORT="best effort"),
        },
        "sensor_msgs.msg": {"JointState": "JointState"},
        "trajectory_msgs.msg": {"JointTrajectory": JointTrajectory, "JointTrajectoryPoint": JointTrajectoryPoint},
        "std_msgs.msg": {"Float64MultiArray": Float64MultiArray},
    }
    for name, members in modules.items():
        module = ModuleType(name)
        vars(module).update(members)
        monkeypatch.setitem(sys.modules, name, module)
        monkeypatch.setitem(sys.modules, name.split(".")[0], sys.modules.get(name.split(".")[0], ModuleType("package")))
    monkeypatch.setattr("hardware.drivers.robots.ros2_robot.FIRST_S", 0.1)
    monkeypatch.setattr("hardware.drivers.robots.ros2_robot.NEXT_S", 0.03)
    return there


def robot(clock=None, **options):
    given = {"states": "/joint_states", "message": "trajectory", "lead_periods": 3.0, "full_effort": None} | options
    return Ros2Robot(Ros2Options(**given), COMMANDS, UR, 0.024, clock or Clock(1.0))


def test_joint_states_are_put_in_the_order_of_the_model_by_their_names(graph):
    ours = robot(full_effort=(10.0, 20.0, 5.0))
    graph.say(["gripper", "elbow_joint", "shoulder_pan_joint", "shoulder_lift_joint"], [9.0, 3.0, 1.0, 2.0], effort=[0.0, 1.0, -5.0, 2.0])
    ours.connect()
    reading = ours.read()
    assert reading.q.tolist() == [1.0, 2.0, 3.0] and np.allclose(reading.load, [-0.5, 0.1, 0.2]) and reading.t_ns is None
    graph.say(UR, [1.0, 2.0, 3.0])
    assert np.all(np.isnan(ours.read().load))  # without efforts
    ours.close()
    assert graph.live == 0


def test_a_set_point_is_a_trajectory_of_one_point_some_periods_ahead(graph):
    ours = robot()
    graph.say(UR, [0.0, 0.0, 0.0])
    ours.connect()
    ours.write(np.array([0.1, 0.2, 0.3]))
    (message,) = graph.sent
    assert message.joint_names == list(UR) and message.points[0].positions == [0.1, 0.2, 0.3]
    assert message.points[0].time_from_start == SimpleNamespace(sec=0, nanosec=24_000_000)


def test_or_positions_alone_in_the_order_of_the_model(graph):
    ours = robot(message="positions")
    graph.say(UR, [0.0, 0.0, 0.0])
    ours.connect()
    ours.write(np.array([0.1, 0.2, 0.3]))
    assert graph.sent == [Float64MultiArray([0.1, 0.2, 0.3])]


def test_stamps_of_another_clock_are_those_of_the_world_and_even(graph):
    """States come every 10 ms by their stamps, with delays of 0 to 4 ms; what is stamped is more even than what arrives."""
    clock, rng = SimpleNamespace(t_ns=0), np.random.default_rng(0)
    clock.now_ns = lambda: clock.t_ns
    ours, stamps_ns, arrivals_ns = robot(clock), [], []
    for k in range(300):
        sent_ns = 10_000_000 * k
        clock.t_ns = sent_ns + int(rng.uniform(0.0, 4e6))
        graph.say(UR, [0.0, 0.0, 0.0], stamp=divmod(1_790_000_000_123_000_000 + sent_ns, 1_000_000_000))
        if k == 0:
            ours.connect()
        stamps_ns.append(ours.read().t_ns)
        arrivals_ns.append(clock.t_ns)
    assert np.all(np.diff(stamps_ns) > 0) and np.all(np.array(stamps_ns) <= arrivals_ns)
    assert np.std(np.diff(stamps_ns[100:])) < 0.2 * np.std(np.diff(arrivals_ns[100:]))


def test_a_state_that_comes_twice_is_no_new_reading(graph):
    ours = robot()
    graph.say(UR, [0.0, 0.0, 0.0], stamp=(5, 1))
    ours.connect()
    ours.read()
    graph.say(UR, [0.0, 0.0, 0.0], stamp=(5, 1))
    with pytest.raises(NoAnswer, match="no new joint state on /joint_states"):
        ours.read()


def test_what_is_missing_is_named(graph):
    with pytest.raises(NoAnswer, match="no new joint state"):
        robot().connect()
    graph.say(UR, [0.0, 0.0, 0.0])
    graph.listeners = 0
    with pytest.raises(NoAnswer, match="no controller listens on /scaled_joint"):
        RobotOpener(WatchedRobot(robot(), Clock(1.0)), COMMANDS, "").open()
    graph.listeners = 1
    graph.say(["a", "b"], [0.0, 0.0])
    ours = robot()
    ours.connect()
    with pytest.raises(OioError, match=r"/joint_states has no joint shoulder_pan_joint; it has a, b.*joint_names"):
        ours.read()
    graph.say(UR, [0.0, float("nan"), 0.0])
    with pytest.raises(OioError, match=r"\(position\) gave nan for joint shoulder_lift_joint"):
        ours.read()


def test_without_ros_it_says_what_to_do(monkeypatch):
    monkeypatch.setitem(sys.modules, "sensor_msgs.msg", None)
    with pytest.raises(BadInput, match=r"sensor_msgs\.msg cannot be imported.*setup\.bash.*backend\.arm\.driver=python"):
        robot()


def test_messages_that_do_not_exist_are_refused():
    with pytest.raises(BadInput, match="it can be trajectory, positions"):
        robot(message="velocity")
