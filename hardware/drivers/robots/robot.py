"""Protocol of an arm that another program or library commands."""

from typing import Protocol

from hardware.drivers.arms.joint_reading import JointReading
from oio.core.records import Array


class Robot(Protocol):
    """All methods raise Unplugged when the arm is gone, NoAnswer for a time-out, and OioError for what no waiting helps against.

    Joints are those of the arm's model, all n of them, in its order; rad, or m of a slide.
    """

    name: str  # value of backend.arm.driver=

    def connect(self) -> None:
        """Connect, without a motion. May be called again after `close`."""
        ...

    def describe(self) -> str:
        """Return what it says of itself, once it is connected."""
        ...

    def read(self) -> JointReading:
        """Return what it says of its joints now."""
        ...

    def write(self, set_point: Array) -> None:
        """Lead it to set_point (n,), which is a small step from the one before; returns at once."""
        ...

    def close(self) -> None:
        """Let go of the connection; never raises."""
        ...
