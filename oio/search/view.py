"""Input of a search strategy: the belief and the moves so far."""

from dataclasses import dataclass

from oio.core.records import Array, Belief
from oio.inference.map_fit import Fit
from oio.inference.state_space import StateSpace
from oio.kinematics.arm import Arm


@dataclass(frozen=True)
class Move:
    """A finished move: its goal q (n,) rad, the fraction `bouts` of its readings that were bouts, the mean signal at its end [ppm];
    `smelt`, the joints (n,) rad at a whiff (gas not left in the sensor by an earlier sniff) or None; `silent`: clean air throughout."""

    q: Array
    bouts: float
    ppm: float
    whiff_q: Array | None = None
    silent: bool = False
    element_ppm: tuple[float, ...] = ()  # signal of each element at its end; empty if one was not read


@dataclass(frozen=True)
class View:
    """The search so far, as passed to a strategy."""

    arm: Arm
    model: StateSpace
    belief: Belief | None  # None until the first belief map
    hypotheses: tuple[Fit, ...]
    moves: tuple[Move, ...]
    dwell_s: float
    standoff_m: float  # minimum distance of the nose from the believed source
    law: Array | None = None  # calibrated mean (LAW,) of the range law, used before the first belief; None: the nominal law
