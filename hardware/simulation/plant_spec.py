"""What a simulated bench is made of."""

from dataclasses import dataclass

from oio.core.interfaces import Air, SimulatedSensor
from oio.core.seeds import Seeds
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
