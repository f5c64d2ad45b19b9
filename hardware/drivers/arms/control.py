"""Settings of the control cycle of an arm, whatever commands it."""

from typing import Annotated

from oio.core.settings import Within, settings


@settings
class ArmControl:
    """How often an arm is read and led, and what stops it."""

    period_s: Annotated[float, Within(0.005, 0.1)]  # control period: joints are read and given a set-point this often
    tracking_error_deg: Annotated[float, Within(1, 180)]  # tracking error of a joint,
    tracking_error_s: Annotated[float, Within(0.05, 60)]  # that lasts for this long, holds the arm: an obstacle, or a stuck encoder
    # moved_by_hand_deg: an arm that was away, and comes back this far from where it was held, was moved by hand
    moved_by_hand_deg: Annotated[float, Within(0.5, 180)]
    torque_off_at_end: bool  # disable torque at the end; else the joints hold their position
