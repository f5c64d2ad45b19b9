"""Settings of the control cycle of an arm of servos."""

from typing import Annotated

from hardware.drivers.arms.control import ArmControl
from oio.core.settings import Within, settings


@settings
class ServoControl(ArmControl):
    """Besides those of any arm: how often the health of a servo is read, and how long it may complain."""

    # health_every: control periods between two readings of a servo's voltage and temperature, one servo after the other
    health_every: Annotated[int, Within(1, 10_000)]
    fault_cycles: Annotated[int, Within(0, 10_000)]  # control periods in a row with a fault, after which the arm is stopped
