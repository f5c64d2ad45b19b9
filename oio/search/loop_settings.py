"""Settings of the closed loop of a search: its parts, when it maps, how long it sniffs, and when it ends (`closed_loop.ClosedLoop`)."""

from typing import Annotated

from oio.core.interfaces import Sensor
from oio.core.settings import Within, refuse_below, settings
from oio.estimators.base import Estimator
from oio.gas.detection_rule import DetectionRule
from oio.inference.base import Localizer
from oio.kinematics.arm import Arm
from oio.search.base import Strategy
from oio.search.elsewhere import LookElsewhere
from oio.search.mapping_policy import MappingPolicy
from oio.search.stop_rule import StopRule
from oio.search.verification import Verification


@settings
class LoopSettings:
    """Settings of a closed loop, the keys of the stage `navigate`."""

    sensor: Sensor
    arm: Arm
    ekf: Estimator
    belief_map: Localizer
    search: Strategy
    bout: DetectionRule
    mapping: MappingPolicy
    # whiff_sigmas: a whiff is so far above what is left of an earlier sniff, in standard deviations of one reading
    whiff_sigmas: Annotated[float, Within(0, 1e6)]
    max_moves: Annotated[int, Within(4, 10_000)]
    max_s: Annotated[float, Within(1, 1e6)]
    dwell_s: Annotated[float, Within(0, 600)]
    dwell_taus: Annotated[float, Within(0, 10)]  # and so many lags on top
    standoff_m: Annotated[float, Within(0, 10)]  # the nose keeps this far from where the source is believed
    stop: StopRule
    verification: Verification
    elsewhere: LookElsewhere
    belief_every_s: Annotated[float, Within(0, 1e6)]  # between two beliefs in the log, besides those of maps

    def check(self) -> None:
        """Refuse a search that cannot begin or end."""
        refuse_below(self, "max_moves", "mapping.explore_moves")

    @property
    def sniff_s(self) -> float:
        """How long the nose dwells at every goal [s]."""
        return self.dwell_s + self.dwell_taus * self.sensor.tau_rise_s
