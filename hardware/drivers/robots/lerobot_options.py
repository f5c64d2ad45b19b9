"""Settings of an arm that LeRobot commands."""

from collections.abc import Mapping
from typing import Any

from oio.core.settings import settings


@settings
class LerobotOptions:
    """Which of LeRobot's robots, and what its configuration has besides `port` and `id`."""

    type: str | None  # as in `lerobot-calibrate --robot.type=`
    id: str | None  # as in `lerobot-calibrate --robot.id=`: it names the calibration file
    options: Mapping[str, Any] | None  # further fields of its configuration
