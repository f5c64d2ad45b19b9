"""A bag as `ros2 bag record -s mcap` leaves it, for tests."""

import numpy as np
import pytest

T0_NS = 1_764_432_000_000_000_000
JOINT_STATE = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


def ros2_log(path):
    """A log of a bag: joint states at 100 Hz, a gas value twice a second, 1 ms later."""
    ros2 = pytest.importorskip("mcap_ros2.writer")
    with path.open("wb") as file:
        writer = ros2.Writer(file)
        state, value = (
            writer.register_msgdef("sensor_msgs/msg/JointState", JOINT_STATE),
            writer.register_msgdef("std_msgs/msg/Float32", "float32 data"),
        )
        for i in range(2000):
            t_ns = T0_NS + 10_000_000 * i
            stamp = {"sec": t_ns // 10**9, "nanosec": t_ns % 10**9}
            joints = {"name": ["lift", "pan"], "position": [0.001 * i, np.sin(0.01 * i)], "velocity": [], "effort": []}
            writer.write_message("/joint_states", state, {"header": {"stamp": stamp, "frame_id": ""}, **joints}, log_time=t_ns)
            if i % 50 == 0:
                writer.write_message("/co2", value, {"data": 420.0 + i}, log_time=t_ns + 1_000_000)
        writer.finish()
