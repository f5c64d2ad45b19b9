"""The results that stages hand to each other."""

from dataclasses import dataclass

from oio.core.records import Array
from oio.gas.bouts import ElementBaseline
from oio.gas.timing import Delay
from oio.gas.trace import Trace
from oio.inference.map_fit import Fit
from oio.inference.prior import Prior
from oio.inference.uncertainty import Noise, TypeA, TypeB
from oio.search.view import Move


@dataclass(frozen=True)
class WarmUpResult:
    """The end of warm-up: seconds waited, last slope of each element [ppm/min] with its standard error, noise scale of the window."""

    waited_s: float
    slope_ppm_per_min: tuple[float, ...]
    slope_u_ppm_per_min: tuple[float, ...]
    noise_scale: float  # variance about the line over the sensor's nominal variance
    readings: int


@dataclass(frozen=True)
class BaselineResult:
    """Every element in clean air; when the calibration began."""

    elements: tuple[ElementBaseline, ...]
    noise_scale: float
    began_ns: int


@dataclass(frozen=True)
class BoutCalibration:
    """The climb up the DoF ladder: Type A per rung, and the trace of the climb (the arm has all of `dof` joints in it)."""

    rungs: tuple[TypeA, ...]
    trace: Trace

    @property
    def last(self) -> TypeA:
        """The top rung."""
        return self.rungs[-1]


@dataclass(frozen=True)
class Repeat:
    """One trilateration of the known source: the Voronoi vertex of the spheres, the refined one, and its covariance."""

    centres_m: Array  # (k, 3)
    radii_m: Array  # (k,)
    vertex_m: Array | None  # (3,), None if the spheres do not determine one
    refined_m: Array  # (3,)
    refined_cov_m2: Array  # (3, 3)
    miss_m: float
    nees: float


@dataclass(frozen=True)
class MapCalibration:
    """The fit on the known source, and how well repeats of five measurements find it."""

    fit: Fit
    repeats: tuple[Repeat, ...]
    type_b: TypeB
    ended_ns: int
    error_ppm: float
    moves: int
    delay: Delay


@dataclass(frozen=True)
class Calibration:
    """What the filter starts from: calibrated with the chosen assembly and with the paper's, and cold."""

    chosen: Prior
    paper: Prior
    cold: Prior
    noise: Noise
    time_s: float
    error_ppm: float
    u_a_ppm: float
    u_b_m: float
    moves: int
    baselines: tuple[ElementBaseline, ...]


@dataclass(frozen=True)
class Navigation:
    """The search: when it ran, when maps were made (re-runs over the log make theirs then) and what they said, and how it ended."""

    began_ns: int
    ended_ns: int
    maps_ns: tuple[int, ...]
    maps: tuple[tuple[Fit, ...], ...]
    move_ends_ns: tuple[int, ...]
    made: tuple[Move, ...]
    declared: bool
    source_m: tuple[float, ...]
    sd_m: float

    @property
    def moves(self) -> int:
        """Finished moves."""
        return len(self.move_ends_ns)
