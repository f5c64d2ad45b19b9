"""What `python -m oio.localise` found in a log."""

from dataclasses import dataclass

from oio.api.calibration import Calibration
from oio.api.location import Location
from oio.api.log_file import LogFile
from oio.api.samples import JointPath, Readings
from oio.api.setup import Setup


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """Log, path and readings that were used, the calibration if there is one, and the location; None where the log only calibrates."""

    log: LogFile
    path: JointPath
    readings: Readings | None
    setup: Setup
    calibration: Calibration | None
    location: Location | None
