"""Driver of an arm that another program or library commands: the guard, the cycle and the checks are those of every arm."""

import contextlib
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from hardware.drivers.arms.arm_driver import ArmDriver
from hardware.drivers.arms.control import ArmControl
from hardware.drivers.arms.joint_reading import JointReading
from hardware.drivers.arms.shared_guard import SharedGuard
from hardware.drivers.robots.reading_monitors import JumpMonitor, StaleMonitor
from hardware.drivers.robots.robot import Robot
from hardware.drivers.robots.watched_robot import WatchedRobot
from hardware.transport.clock import Clock
from hardware.transport.driver import Counts
from hardware.transport.mailbox import Mailbox
from hardware.transport.port import NoAnswer, Unplugged
from oio.core.errors import BadInput, OioError
from oio.core.records import Array, seconds
from oio.gas.source import unlocked
from oio.kinematics.arm import Arm
from oio.motion.guard import SafetyLimits

TURN = 2.0 * math.pi
ELSEWHERE = "if it stands there, its zeros or directions are not those of the model (arm.mjcf)"


class RobotArm(ArmDriver[Robot]):
    """Driver of all joints of an arm over a `Robot`. What it raises, other than a missing reading, stops the arm and ends the run."""

    def __init__(self, robot: Robot, control: ArmControl, arm: Arm, safety: SafetyLimits, mailbox: Mailbox, clock: Clock) -> None:
        guard = SharedGuard(control, arm, safety, clock, ELSEWHERE, hold_step_rad=arm.joint_speed * control.period_s)
        super().__init__(control, guard, arm.all_names, arm.dof, mailbox, clock)
        self.robot, self.name, self._whole = WatchedRobot(robot, clock), robot.name, unlocked(arm)
        self._jumps = JumpMonitor(arm.all_names, arm.joint_speed, control.tracking_error_deg)
        self._stale, self._top_load = StaleMonitor(control.tracking_error_s), math.nan

    def configure(self, robot: Robot) -> str:
        """Hold the arm where it is; return what it says of itself.

        Raises BadInput for a first reading that is none, and OioError for a pose outside the limits: no safe path from there is known.
        """
        try:
            q = robot.read().q
        except OioError as error:
            raise BadInput(str(error)) from error
        if np.max(np.abs(q)) > TURN and self._whole.is_allowed(np.radians(q)):
            raise BadInput(
                f"backend.arm.driver={self.name} says that the joints are at {np.round(q, 2).tolist()}, where they may not be as radians, "
                f"but may as degrees: give radians."
            )
        self._guard.connect(q)
        self._jumps.restart()
        self._stale.restart()
        self._send_set_point(robot)
        return robot.describe()

    def release(self, robot: Robot) -> None:
        """Stop at the present set-point; an arm that failed before may do so again."""
        with contextlib.suppress(OioError):
            super().release(robot)

    @property
    def health_summary(self) -> str:
        """Highest load read so far, as text."""
        return "no load told" if math.isnan(self._top_load) else f"load at most {100 * self._top_load:.0f} %"

    def counts(self) -> Counts:
        """Polling cycles so far."""
        return Counter(lost=self._lost, rounds=self._rounds)

    def _read(self, robot: Robot) -> JointReading:
        with self._stopping():
            reading = robot.read()
        self._top_load = float(np.fmax.reduce(np.abs(reading.load), initial=self._top_load))
        t_ns = self._clock.now_ns() if reading.t_ns is None else reading.t_ns
        wrong = self._jumps.check(seconds(t_ns), reading.q) or self._stale.check(seconds(t_ns), reading.q, self._guard.set_point)
        return reading if wrong is None else replace(reading, fault=wrong, is_plausible=False)

    def _write(self, robot: Robot, set_point: Array) -> None:
        with self._stopping():
            robot.write(set_point.copy())

    @contextlib.contextmanager
    def _stopping(self) -> Iterator[None]:
        """Hold the arm when the block raises what no waiting helps against."""
        try:
            yield
        except OioError as error:
            self.stop(str(error))
            raise OioError(f"the arm was stopped: {error} What was logged so far can be read.") from error


class RobotOpener:
    """The way to a robot: connecting it. A mistake of its own is bad input."""

    def __init__(self, robot: WatchedRobot, port: str, advice: str) -> None:
        self.port, self.advice, self._robot = port, advice, robot

    @property
    def call_s(self) -> float:
        """See `Opener`."""
        return self._robot.call_s

    def open(self) -> Robot:
        """Connect the robot."""
        try:
            self._robot.connect()
        except (NoAnswer, Unplugged):
            self._robot.close()
            raise
        except OioError as error:
            self._robot.close()
            raise BadInput(str(error)) from error
        return self._robot
