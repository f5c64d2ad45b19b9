"""Drivers of real arms, and which of them is at which port."""

from collections.abc import Callable

from hardware.drivers.servos.bus import Bus
from hardware.drivers.servos.dynamixel import Dynamixel
from hardware.drivers.servos.feetech import Feetech
from oio.core.errors import BadInput
from oio.core.settings import in_range, settings

BUSES: dict[str, Callable[[], Bus]] = {"feetech": Feetech, "dynamixel": Dynamixel}
NONE = "none"


@settings
class ArmPort:
    """One arm: its servos, its port, its homing."""

    driver: str
    port: str | None  # a path, usb:VENDOR:PRODUCT[:SERIAL], or ask
    period_s: float  # joints are read and led this often
    tracking_error_deg: float  # a joint that is so far from where it was led,
    tracking_error_s: float  # for so long, holds the arm: something is in its way, or its encoder is stuck
    release: bool  # let go of the joints at the end; else they hold where they are

    def check(self) -> None:
        """Refuse unknown servos, an arm without a port, and a rhythm that no bus keeps."""
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
        in_range(self, period_s=(0.005, 0.1), tracking_error_deg=(1.0, 180.0), tracking_error_s=(0.05, 60.0))

    def bus(self) -> Bus:
        """Of the driver."""
        return BUSES[self.driver]()
