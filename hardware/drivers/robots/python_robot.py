"""An arm that a Python object of the user's commands: `read()` -> positions, `write(positions)`, `close()`.

Positions are those of all joints of the arm's model, in its order: rad, or m of a slide. Optional are `describe()` -> text, `effort()` ->
one fraction of full load for each joint, asked for after each `read()`, and an attribute `simulated = True`, without which
`backend.speed` must be 1.
"""

import contextlib
from typing import Any

import numpy as np

from hardware.drivers.arms.joint_reading import JointReading
from hardware.drivers.robots.foreign_call import checked_joints, foreign_call
from hardware.drivers.robots.user_object import load_user_object, made
from oio.core.records import Array

ADVICE = "Look at what your object waits for: its own connection, or the program behind it."


class PythonRobot:
    """See `Robot`. A class or a function is called, without arguments, each time the arm is connected; an object is taken as it is."""

    name = "python"

    def __init__(self, target: str, names: tuple[str, ...]) -> None:
        self._target, self._names, self._loaded = target, names, load_user_object("backend.arm.port", target)
        self._unknown = np.full(len(names), np.nan)
        self._arm: Any = None

    def connect(self) -> None:
        """See `Robot`."""
        self._arm = made(self._target, self._loaded)

    def describe(self) -> str:
        """See `Robot`."""
        if not hasattr(self._arm, "describe"):
            return f"{type(self._arm).__name__} of {self._target}"
        return " ".join(str(foreign_call(self._named("describe"), self._arm.describe)).split())

    def read(self) -> JointReading:
        """See `Robot`."""
        q = self._joints("read")
        return JointReading(q, self._joints("effort") if hasattr(self._arm, "effort") else self._unknown, self._unknown)

    def write(self, set_point: Array) -> None:
        """See `Robot`."""
        foreign_call(self._named("write"), lambda: self._arm.write(set_point))

    def close(self) -> None:
        """See `Robot`."""
        arm, self._arm = self._arm, None
        if arm is not None:
            with contextlib.suppress(Exception):
                arm.close()

    def _joints(self, method: str) -> Array:
        what = self._named(method)
        return checked_joints(what, foreign_call(what, getattr(self._arm, method)), self._names)

    def _named(self, method: str) -> str:
        return f"backend.arm.port={self._target}: {method}()"
