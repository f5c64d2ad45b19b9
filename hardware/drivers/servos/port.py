"""Configuration of a real arm's port: driver selection and limits."""

from collections.abc import Callable
from typing import Annotated

from hardware.drivers.servos.bus import Bus
from hardware.drivers.servos.dynamixel import Dynamixel
from hardware.drivers.servos.feetech import Feetech
from oio.core.errors import BadInput
from oio.core.settings import Within, settings

BUSES: dict[str, Callable[[], Bus]] = {"feetech": Feetech, "dynamixel": Dynamixel}
NONE = "none"


@settings
class ArmPort:
    """Port of one arm: servo driver, port, control period, first move and limits."""

    driver: str
    port: str | None  # a path, usb:VENDOR:PRODUCT[:SERIAL], or ask
    period_s: Annotated[float, Within(0.005, 0.1)]  # control period: joints are read and given a set-point this often
    tracking_error_deg: Annotated[float, Within(1, 180)]  # tracking error of a joint,
    tracking_error_s: Annotated[float, Within(0.05, 60)]  # that lasts for this long, holds the arm: an obstacle, or a stuck encoder
    home_s: Annotated[float, Within(0.5, 60)]  # least duration of the first move, to the arm's home
    hands_off_deg: Annotated[float, Within(0, 180)]  # an arm farther from home may be held by a person until it holds itself,
    hands_off_s: Annotated[float, Within(0, 60)]  # who gets this long to let go
    # moved_by_hand_deg: an arm that was away, and comes back this far from where it was held, was moved by hand
    moved_by_hand_deg: Annotated[float, Within(0.5, 180)]
    # health_every: control periods between two readings of a servo's voltage and temperature, one servo after the other
    health_every: Annotated[int, Within(1, 10_000)]
    fault_cycles: Annotated[int, Within(0, 10_000)]  # control periods in a row with a fault, after which the arm is stopped
    torque_off_at_end: bool  # disable torque at the end; else the joints hold their position

    def check(self) -> None:
        """Refuse unknown servos, an arm without a port, and a period that no bus can keep."""
        allowed = (*BUSES, NONE)
        if self.driver not in allowed:
            raise BadInput(
                f"backend.arm.driver={self.driver} was given, but it can be {', '.join(allowed)}. Type backend.arm.driver=feetech."
            )
        if self.driver != NONE and self.port is None:
            raise BadInput(
                f"backend.arm.driver={self.driver} has no port. Type backend.arm.port=/dev/ttyUSB0 (python -m hardware.ports finds it), or "
                f"backend.arm.driver=none."
            )

    def bus(self) -> Bus:
        """Create the servo bus of the driver."""
        return BUSES[self.driver]()
