"""Entries of a log beside world samples, readings and innovations: what a watcher is told while a run goes on, and reads from a file."""

from collections.abc import Callable
from dataclasses import dataclass

from oio.core.records import Array, GasReading, Innovation, WorldSample


@dataclass(frozen=True, slots=True)
class StageMark:
    """Begin or end of a stage: `state` is `begin`, `end` or `failed`; `why` is the error of one that failed."""

    t_ns: int
    stage: str
    state: str
    why: str = ""


@dataclass(frozen=True, slots=True)
class Progress:
    """What a stage waits for, and its current figure."""

    t_ns: int
    stage: str
    waits_for: str
    figure: str


@dataclass(frozen=True, slots=True, eq=False)
class BelievedNose:
    """The nose as the filter believes it: (3,) m and covariance (3, 3) m^2 in frame base."""

    t_ns: int
    nose_m: Array
    cov: Array


@dataclass(frozen=True, slots=True, eq=False)
class BeliefScene:
    """Range spheres (k, 3) m, (k,) m, hypotheses of the source, best first, each (3,) m and (3, 3) m^2, and a line of text."""

    t_ns: int
    centres_m: Array
    radii_m: Array
    hypotheses: list[tuple[Array, Array]]
    text: str


@dataclass(frozen=True, slots=True, eq=False)
class ArmFrames:
    """Frames link1, ..., linkM, nose as the encoders have them, each in the one before: places (m + 1, 3) m, quaternions (m + 1, 4)."""

    t_ns: int
    places_m: Array
    turns: Array


@dataclass(frozen=True, slots=True, eq=False)
class Setup:
    """What stands still: steps_m (m + 1, 3), in each frame of the arm from the base on the place where the next begins; rails of sliding
    joints (the number of their frame and two ends (3,) m in it); the box of the nose (2, 3) m and the beacon (3,) m in frame base."""

    steps_m: Array
    rails: list[tuple[int, Array, Array]]
    box_m: Array
    beacon_m: Array | None


Entry = WorldSample | GasReading | Innovation | StageMark | Progress | BelievedNose | BeliefScene | ArmFrames | Setup
Watcher = Callable[[Entry], None]
