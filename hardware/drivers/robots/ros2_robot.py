"""An arm that a ROS 2 controller commands: joint states from one topic, set-points to another."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from hardware.drivers.arms.joint_reading import JointReading
from hardware.drivers.robots.foreign_call import checked_joints, foreign_call
from hardware.drivers.robots.ros2_link import Ros2Link, imported
from hardware.drivers.robots.ros2_options import Ros2Options
from hardware.transport.clock import Clock, DeviceClock
from oio.core.errors import OioError
from oio.core.records import SECOND_NS, Array

FIRST_S, NEXT_S = 2.0, 0.1  # the other side, and a joint state, are waited for, at most [host s]
ADVICE = "`ros2 topic hz` says whether joint states come, `ros2 control list_controllers` whether the controller is active."


class Ros2Robot:
    """See `Robot`. `names`: ROS's names of the joints, in the order of the arm's model; `lead_s`: until a point is to be reached [s]."""

    name = "ros2"

    def __init__(self, options: Ros2Options, commands: str, names: tuple[str, ...], lead_s: float, clock: Clock) -> None:
        self._options, self._commands, self._names, self._lead_s, self._clock = options, commands, names, lead_s, clock
        imported("sensor_msgs.msg")
        self._is_trajectory = options.message == "trajectory"
        self._command_type = (
            imported("trajectory_msgs.msg").JointTrajectory if self._is_trajectory else imported("std_msgs.msg").Float64MultiArray
        )
        self._full_effort = np.full(len(names), np.nan) if options.full_effort is None else np.array(options.full_effort)
        self._link: Ros2Link | None = None
        self._stamps, self._newest, self._last_stamp = DeviceClock(), list[Any](), (0, 0)
        self._first_s: int | None = None  # stamps count from here

    def connect(self) -> None:
        """See `Robot`."""
        self._link = foreign_call("rclpy", lambda: Ros2Link(self._options.states, self._commands, self._command_type, self._heard))
        self._wait(FIRST_S)
        self._link.wait_for_listener(FIRST_S)

    def describe(self) -> str:
        """See `Robot`."""
        return f"joint states of {self._options.states}, {self._options.message} to {self._commands}"

    def read(self) -> JointReading:
        """See `Robot`: the newest joint state that has not been read yet."""
        self._wait(NEXT_S)
        message, arrived_ns = self._newest.pop(), self._clock.now_ns()
        order = self._order(message.name)
        q = checked_joints(f"{self._options.states} (position)", [_at(message.position, i) for i in order], self._names)
        load = np.array([_at(message.effort, i) for i in order]) / self._full_effort
        return JointReading(q, load, np.full(len(q), np.nan), t_ns=self._stamped(message.header.stamp, arrived_ns))

    def write(self, set_point: Array) -> None:
        """See `Robot`."""
        link = self._link
        assert link is not None
        foreign_call("rclpy's publish()", lambda: link.publish(self._message(set_point)))

    def close(self) -> None:
        """See `Robot`."""
        link, self._link = self._link, None
        self._newest.clear()
        if link is not None:
            link.close()

    def _heard(self, message: Any) -> None:
        """Keep a joint state if it is newer than the last: a stamp that comes twice is no new reading."""
        stamp = (message.header.stamp.sec, message.header.stamp.nanosec)
        if stamp == (0, 0) or stamp != self._last_stamp:
            self._last_stamp = stamp
            self._newest[:] = [message]

    def _wait(self, within_s: float) -> None:
        link = self._link
        assert link is not None
        foreign_call("rclpy's spin_once()", lambda: link.wait(lambda: bool(self._newest), within_s))

    def _order(self, there: Sequence[str]) -> list[int]:
        """Return where the joints are among those of a message. Raises OioError for one that is missing."""
        missing = [name for name in self._names if name not in there]
        if missing:
            raise OioError(
                f"{self._options.states} has no joint {missing[0]}; it has {', '.join(there)}. Give ROS's names of the arm's joints, from "
                f"the base to the nose: 'backend.arm.joint_names=[{','.join(sorted(there))}]', in that order."
            )
        return [list(there).index(name) for name in self._names]

    def _stamped(self, stamp: Any, arrived_ns: int) -> int | None:
        """Return the time of a stamp of ROS [ns, world clock]; None if it has none."""
        if (stamp.sec, stamp.nanosec) == (0, 0):
            return None
        self._first_s = stamp.sec if self._first_s is None else self._first_s
        return self._stamps.to_world_ns(1e3 * (stamp.sec - self._first_s) + 1e-6 * stamp.nanosec, arrived_ns)

    def _message(self, set_point: Array) -> Any:
        if not self._is_trajectory:
            return self._command_type(data=set_point.tolist())
        point = imported("trajectory_msgs.msg").JointTrajectoryPoint(positions=set_point.tolist())
        whole_s = math.floor(self._lead_s)
        point.time_from_start.sec, point.time_from_start.nanosec = whole_s, round((self._lead_s - whole_s) * SECOND_NS)
        return self._command_type(joint_names=list(self._names), points=[point])  # its stamp of 0 means: from now on


def _at(values: Sequence[float], index: int) -> float:
    """A number of a message; NaN if it has none there, as efforts are often left out."""
    return float(values[index]) if index < len(values) else math.nan
