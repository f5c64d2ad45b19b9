"""The calls of rclpy that an arm needs: a node with one subscription and one publisher, in a context of its own.

ROS 2's own handlers of Ctrl-C stay off: a run ends by its own. Sources: rclpy and ros2_controllers, their documentation of Jazzy.
"""

import contextlib
import importlib
import sys
import time
from collections.abc import Callable
from typing import Any

from hardware.drivers.robots.foreign_call import told
from hardware.transport.port import NoAnswer
from oio.core.errors import BadInput

NODE = "oio_arm"
REST_S = 0.05  # at a time [host s]: a listener that comes makes no event
NEWEST = 1  # depth of the queues: an older state, or set-point, is of no use


def imported(name: str) -> Any:
    """Return a module of ROS 2. Raises BadInput with what to do if it is not there."""
    try:
        return importlib.import_module(name)
    except (ImportError, OSError) as error:
        version = ".".join(map(str, sys.version_info[:2]))
        raise BadInput(
            f"backend.arm.driver=ros2 was given, but {name} cannot be imported: {told(error)}. ROS 2 brings it for one Python (3.12 with "
            f"Jazzy; this is {version}). Type . /opt/ros/jazzy/setup.bash first, with oio in a venv of that Python; with a ROS 2 of "
            f"another Python, let a program of yours talk to it: backend.arm.driver=python."
        ) from None


class Ros2Link:
    """A live node. `heard` is called with every JointState, within `wait`."""

    def __init__(self, states: str, commands: str, command_type: Any, heard: Callable[[Any], None]) -> None:
        self._rclpy, qos = imported("rclpy"), imported("rclpy.qos")
        self._context = imported("rclpy.context").Context()
        signals = imported("rclpy.signals").SignalHandlerOptions.NO
        self._rclpy.init(args=[], context=self._context, signal_handler_options=signals)
        self._node = self._rclpy.create_node(NODE, context=self._context)
        self._executor = imported("rclpy.executors").SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        newest = qos.QoSProfile(depth=NEWEST, reliability=qos.ReliabilityPolicy.BEST_EFFORT)  # hears reliable publishers, too
        self._node.create_subscription(imported("sensor_msgs.msg").JointState, states, heard, newest)
        self._publisher = self._node.create_publisher(command_type, commands, NEWEST)
        self._states, self._commands = states, commands

    def wait(self, until: Callable[[], bool], within_s: float) -> None:
        """Take what comes in until `until` holds. Raises NoAnswer after within_s [host s]."""
        if not self._spin(until, within_s):
            raise NoAnswer(f"no new joint state on {self._states}")

    def wait_for_listener(self, within_s: float) -> None:
        """Wait until somebody takes the set-points. Raises NoAnswer after within_s [host s]."""
        if not self._spin(lambda: self._publisher.get_subscription_count() > 0, within_s):
            raise NoAnswer(f"no controller listens on {self._commands}")

    def _spin(self, until: Callable[[], bool], within_s: float) -> bool:
        """Take what comes in until `until` holds; return whether it does within within_s [host s]."""
        end_s = time.monotonic() + within_s
        while not until():
            left_s = end_s - time.monotonic()
            if left_s <= 0:
                return False
            self._executor.spin_once(timeout_sec=min(left_s, REST_S))
        return True

    def publish(self, message: Any) -> None:
        """Send a set-point."""
        self._publisher.publish(message)

    def close(self) -> None:
        """End the node; never raises."""
        for end in (self._executor.shutdown, self._node.destroy_node, self._context.try_shutdown):
            with contextlib.suppress(Exception):
                end()
