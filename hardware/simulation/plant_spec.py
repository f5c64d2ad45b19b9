"""What a simulated bench is made of."""

from dataclasses import dataclass, replace

from hardware.simulation.world_changes import WorldChanges
from oio.core.interfaces import Air, SimulatedSensor
from oio.core.seeds import Seeds
from oio.core.settings import itself
from oio.gas.source import Source
from oio.kinematics.arm import Arm


@dataclass(frozen=True)
class PlantSpec:
    """Specification of a plant; frozen."""

    arm: Arm
    sensor: SimulatedSensor
    air: Air
    beacon: Source
    source: Source
    seeds: Seeds
    background_ppm: float
    emission_ml_s: float
    period_s: float  # control period
    air_every: int  # ticks per step of the air
    encoder_counts: int  # per turn
    changes: WorldChanges
    __deepcopy__ = itself

    @property
    def simulated_arm(self) -> Arm:
        """The arm as it is simulated: its backlash may differ from what the filter assumes."""
        backlash_deg = self.changes.backlash_deg
        return self.arm if backlash_deg is None else replace(self.arm, backlash_deg=backlash_deg)
