"""An arm that Hugging Face's LeRobot commands, by its `Robot` interface: connect, get_observation, send_action, disconnect.

LeRobot gives joints in degrees, or normalised to the swept range; only degrees are angles. It has calibrated them itself.
Sources: lerobot 0.6.1, robots/robot.py, robots/so_follower/, motors/motors_bus.py (Apache-2.0).
"""

import contextlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from hardware.drivers.arms.joint_reading import JointReading
from hardware.drivers.robots.foreign_call import checked_joints, foreign_call
from hardware.drivers.robots.lerobot_options import LerobotOptions
from hardware.drivers.robots.lerobot_registry import configuration, make_robot
from oio.core.errors import BadInput
from oio.core.records import Array

POS = ".pos"  # suffix of a joint's position among observations and actions
ADVICE = "Check cable and power; `lerobot-calibrate` with the same words connects to the same arm."
CALIBRATE = "Calibrate it: lerobot-calibrate --robot.type={} --robot.id={} --robot.port={}."


class LerobotRobot:
    """See `Robot`. `names`: LeRobot's names of the joints, in the order of the arm's model."""

    name = "lerobot"

    def __init__(self, options: LerobotOptions, port: str, names: tuple[str, ...], torque_off_at_end: bool) -> None:
        self._options, self._port, self._names = options, port, names
        self._config = configuration(options, port, torque_off_at_end)
        self._unknown = np.full(len(names), np.nan)
        self._robot: Any = None

    def connect(self) -> None:
        """See `Robot`."""
        self._robot = foreign_call("LeRobot", lambda: make_robot(self._config))
        self._refuse_others()
        foreign_call("LeRobot's connect()", lambda: self._robot.connect(calibrate=False))
        if not self._robot.is_calibrated:
            options = self._options
            raise BadInput(
                f"backend.arm.lerobot.id={options.id} was given, but LeRobot says that this arm is not calibrated, or has another "
                f"calibration in its servos. {CALIBRATE.format(options.type, options.id, self._port)}"
            )

    def describe(self) -> str:
        """See `Robot`."""
        return f"LeRobot {self._options.type} {self._options.id}"

    def read(self) -> JointReading:
        """See `Robot`."""
        seen = foreign_call("LeRobot's get_observation()", self._robot.get_observation)
        degrees = checked_joints("LeRobot's get_observation()", [seen.get(name + POS) for name in self._names], self._names)
        return JointReading(np.radians(degrees), self._unknown, self._unknown)

    def write(self, set_point: Array) -> None:
        """See `Robot`."""
        action = {name + POS: float(angle) for name, angle in zip(self._names, np.degrees(set_point), strict=True)}
        foreign_call("LeRobot's send_action()", lambda: self._robot.send_action(action))

    def close(self) -> None:
        """See `Robot`."""
        robot, self._robot = self._robot, None
        if robot is not None:
            with contextlib.suppress(Exception):
                robot.disconnect()

    def _refuse_others(self) -> None:
        """Refuse a robot without these joints, or with joints that are not in degrees."""
        there = [key.removesuffix(POS) for key in self._robot.action_features if key.endswith(POS)]
        missing = [name for name in self._names if name not in there]
        if missing:
            raise BadInput(
                f"LeRobot's {self._options.type} has no joint {missing[0]}; it has {', '.join(there)}. Give the arm's, base "
                f"to nose: 'backend.arm.joint_names=[{','.join(there[: len(self._names)])}]'."
            )
        motors: Mapping[str, Any] = getattr(getattr(self._robot, "bus", None), "motors", {})
        modes = {name: str(getattr(getattr(motors.get(name), "norm_mode", None), "value", "degrees")) for name in self._names}
        wrong = [name for name, mode in modes.items() if mode != "degrees"]
        if wrong:
            raise BadInput(
                f"LeRobot's {self._options.type} gives joint {wrong[0]} as {modes[wrong[0]]}, a share of the range that it was swept over, "
                f"but angles are wanted. Set it to degrees: 'backend.arm.lerobot.options={{use_degrees: true}}', where it has that field."
            )
