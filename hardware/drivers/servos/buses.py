"""The servo buses by the value of `backend.arm.driver=`."""

from collections.abc import Callable

from hardware.drivers.servos.bus import Bus
from hardware.drivers.servos.dynamixel import Dynamixel
from hardware.drivers.servos.feetech import Feetech

BUSES: dict[str, Callable[[], Bus]] = {"feetech": Feetech, "dynamixel": Dynamixel}
