"""Configuration of a real arm's port: driver selection and limits."""

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
    """Port of one arm: servo driver, port, control period and tracking error limits."""

    driver: str
    port: str | None  # a path, usb:VENDOR:PRODUCT[:SERIAL], or ask
    period_s: float  # control period: joints are read and given a set-point this often
    tracking_error_deg: float  # tracking error of a joint,
    tracking_error_s: float  # that lasts for this long, holds the arm: an obstacle, or a stuck encoder
    release: bool  # disable torque at the end; else the joints hold their position

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
        in_range(self, period_s=(0.005, 0.1), tracking_error_deg=(1.0, 180.0), tracking_error_s=(0.05, 60.0))

    def bus(self) -> Bus:
        """Create the servo bus of the driver."""
        return BUSES[self.driver]()
