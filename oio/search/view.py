"""What a strategy sees."""

from dataclasses import dataclass

from oio.core.records import Array, Belief
from oio.inference.map_fit import Fit
from oio.inference.state_space import StateSpace
from oio.kinematics.arm import Arm


@dataclass(frozen=True)
class Move:
    """A finished move: the goal (n,) rad, which fraction of its readings were bouts, the mean signal at its end [ppm]; the joints (n,) rad
    where it smelt gas that no earlier sniff had left in the sensor, if it did; and whether the sensor was as in clean air throughout."""

    q: Array
    bouts: float
    ppm: float
    smelt: Array | None = None
    silent: bool = False


@dataclass(frozen=True)
class View:
    """The search so far."""

    arm: Arm
    model: StateSpace
    belief: Belief | None  # None until the first belief map
    hypotheses: tuple[Fit, ...]
    moves: tuple[Move, ...]
    dwell_s: float
    standoff_m: float  # the nose keeps this far from where the source is believed
    law: Array | None = None  # calibrated mean (LAW,) of the range law, for before the first belief; None: the nominal law
