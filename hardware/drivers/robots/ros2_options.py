"""Settings of an arm that a ROS 2 controller commands."""

from typing import Annotated

from oio.core.errors import BadInput
from oio.core.settings import Within, settings

MESSAGES = ("trajectory", "positions")


@settings
class Ros2Options:
    """Topics and messages; `backend.arm.port` is the topic on which the controller takes its set-points."""

    states: str  # topic of sensor_msgs/JointState
    message: str  # trajectory: trajectory_msgs/JointTrajectory of one point; positions: std_msgs/Float64MultiArray
    lead_periods: Annotated[float, Within(1, 100)]  # of a trajectory: control periods from now until its point is reached
    # full_effort: effort of each joint that counts as full load, N m (N of a slide); null: the load is not watched
    full_effort: Annotated[tuple[float, ...] | None, Within(1e-3, 1e6)]

    def check(self) -> None:
        """Refuse unknown messages."""
        if self.message not in MESSAGES:
            raise BadInput(
                f"backend.arm.ros2.message={self.message} was given, but it can be {', '.join(MESSAGES)}. Type "
                f"backend.arm.ros2.message=trajectory for a JointTrajectoryController, =positions for a forward position controller."
            )
