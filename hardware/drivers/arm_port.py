"""Configuration of a real arm's port: which driver commands it, where it is reached, and limits."""

import os
from typing import Annotated, Any

from hardware.drivers.robots import lerobot_robot, python_robot, ros2_robot
from hardware.drivers.robots.lerobot_options import LerobotOptions
from hardware.drivers.robots.lerobot_robot import LerobotRobot
from hardware.drivers.robots.python_robot import PythonRobot
from hardware.drivers.robots.robot import Robot
from hardware.drivers.robots.robot_arm import RobotArm, RobotOpener
from hardware.drivers.robots.ros2_options import Ros2Options
from hardware.drivers.robots.ros2_robot import Ros2Robot
from hardware.drivers.robots.user_object import load_user_object
from hardware.drivers.servos.buses import BUSES
from hardware.drivers.servos.servo_arm import ServoArm
from hardware.drivers.servos.servo_control import ServoControl
from hardware.transport.clock import Clock
from hardware.transport.mailbox import Mailbox
from hardware.transport.opener import Opener, SerialOpener
from oio.core.errors import BadInput
from oio.core.settings import Within, settings
from oio.kinematics.arm import Arm
from oio.motion.guard import SafetyLimits

ADVICE = {"python": python_robot.ADVICE, "lerobot": lerobot_robot.ADVICE, "ros2": ros2_robot.ADVICE}
PORTS = {"python": "my_arm:Arm", "lerobot": "/dev/ttyUSB0", "ros2": "/joint_trajectory_controller/joint_trajectory"}  # to type, e.g.
NONE = "none"


@settings
class ArmPort(ServoControl):
    """Port of one arm: driver, port, first move and, of robots that others command, how these name things."""

    driver: str
    # port: of servos a path, usb:VENDOR:PRODUCT[:SERIAL], or ask; of python package.module:name; of lerobot its own port; of ros2 a topic
    port: str | None
    joint_names: tuple[str, ...] | None  # of lerobot and ros2: their names of the joints, from the base to the nose; None: the model's
    lerobot: LerobotOptions
    ros2: Ros2Options
    home_s: Annotated[float, Within(0.5, 60)]  # least duration of the first move, to the arm's home
    hands_off_deg: Annotated[float, Within(0, 180)]  # an arm farther from home may be held by a person until it holds itself,
    hands_off_s: Annotated[float, Within(0, 60)]  # who gets this long to let go

    def check(self) -> None:
        """Refuse unknown drivers, and an arm without a port."""
        allowed = (*BUSES, *PORTS, NONE)
        if self.driver not in allowed:
            raise BadInput(
                f"backend.arm.driver={self.driver} was given, but it can be {', '.join(allowed)}. Type backend.arm.driver=feetech."
            )
        if self.driver != NONE and self.port is None:
            find = " (python -m hardware.ports finds it)" if self.driver in BUSES else ""
            raise BadInput(
                f"backend.arm.driver={self.driver} has no port. Type backend.arm.port={PORTS.get(self.driver, '/dev/ttyUSB0')}{find}, or "
                f"backend.arm.driver=none."
            )

    @property
    def real_port(self) -> str | None:
        """The port, unless there is no arm, or it is an emulator's."""
        is_emulated = self.driver in BUSES and os.path.realpath(str(self.port)).startswith("/dev/pts/")
        return None if self.driver == NONE or is_emulated else self.port

    @property
    def may_hurry(self) -> bool:
        """Whether time may go faster than the world's: with a Python object that says that it is simulated. Raises BadInput without it."""
        return self.driver == "python" and getattr(load_user_object("backend.arm.port", str(self.port)), "simulated", False) is True

    @property
    def knows_its_zeros(self) -> bool:
        """Whether the arm gives calibrated joint angles, so that no homing file is needed."""
        return self.driver in PORTS

    def live(self, arm: Arm, safety: SafetyLimits, mailbox: Mailbox, clock: Clock) -> ServoArm | RobotArm | None:
        """Create the driver; None for a fixed mount. Raises BadInput for a robot whose code is not there."""
        if self.driver == NONE:
            return None
        if self.driver in BUSES:
            return ServoArm(BUSES[self.driver](), self, arm, safety, mailbox, clock)
        return RobotArm(self.robot(arm, clock), self, arm, safety, mailbox, clock)

    def opener(self, driver: ServoArm | RobotArm) -> Opener[Any]:
        """Return the way to the arm of a driver."""
        if isinstance(driver, ServoArm):
            return SerialOpener(str(self.port), driver)
        return RobotOpener(driver.robot, str(self.port), ADVICE[self.driver])

    def robot(self, arm: Arm, clock: Clock) -> Robot:
        """Create the robot of a driver that another program commands, not yet connected. Raises BadInput for words that do not fit."""
        port = str(self.port)
        if self.driver == "python":
            return PythonRobot(port, arm.all_names)
        names = arm.all_names if self.joint_names is None else self.joint_names
        if len(names) != len(arm.all_names):
            raise BadInput(f"backend.arm.joint_names has {len(names)} names, but the arm has {len(arm.all_names)} joints: {arm.all_names}.")
        if self.driver == "lerobot":
            return LerobotRobot(self.lerobot, port, names, self.torque_off_at_end)
        if self.ros2.full_effort is not None and len(self.ros2.full_effort) != len(names):
            raise BadInput(f"backend.arm.ros2.full_effort has {len(self.ros2.full_effort)} values, but the arm has {len(names)} joints.")
        return Ros2Robot(self.ros2, port, names, self.ros2.lead_periods * self.period_s, clock)
