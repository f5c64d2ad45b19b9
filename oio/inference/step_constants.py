"""What the compiled prediction step needs of a state space, as flat named tuples."""

from typing import NamedTuple

from oio.core.records import Array
from oio.gas.source_shape import POINT_SOURCE, SourceShape


class GasConstants(NamedTuple):
    """Constants of range law, lag and fluctuation."""

    r_ref_m: float
    radius_m: float
    rise_s: float
    fall_s: float
    gamma: float
    t_s: float  # correlation time at r_ref
    nose_jitter_m: float
    model_discrepancy: float
    rest_speed_rad_s: float
    places_m: Array  # (P, 3), distinct places of the elements in the frame of the last joint
    spacing_m: float  # between two
    sway: float
    sway_s: float
    shape: SourceShape = POINT_SOURCE


class StepConstants(NamedTuple):
    """Constants of a filter step: `walk` (2, N) is the random-walk variance per step and per second."""

    gas: GasConstants
    walk: Array
    drift: float  # random-walk density of the encoders' acceleration [rad^2/s^4/s]
