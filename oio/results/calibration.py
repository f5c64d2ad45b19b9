"""Result records that stages pass to each other: warm-up, baseline, calibration, and the search."""

from dataclasses import dataclass

from oio.gas.bouts import ElementBaseline
from oio.gas.timing import Delay
from oio.gas.trace import Trace
from oio.inference.beacon_repeats import Repeat
from oio.inference.map_fit import Fit
from oio.inference.prior import Prior
from oio.inference.uncertainty import Noise, TypeA, TypeB
from oio.runtime.gas_stream import StreamGaps
from oio.search.view import Move


@dataclass(frozen=True)
class WarmUpResult:
    """Result of warm-up: waiting time [s], last slope of each element [ppm/min] with its standard error, noise scale of the window, and
    the slope below which the sensor counts as at rest."""

    waited_s: float
    slope_ppm_per_min: tuple[float, ...]
    slope_u_ppm_per_min: tuple[float, ...]
    noise_ratios: tuple[float, ...]  # of each element: variance about the fitted line over the sensor's nominal variance
    readings: int
    rest_ppm_per_min: float

    @property
    def noise_scale(self) -> float:
        """Mean of the noise ratios."""
        return sum(self.noise_ratios) / len(self.noise_ratios)


@dataclass(frozen=True)
class BaselineResult:
    """Clean-air baselines of all elements; `began_ns`: start of the calibration."""

    elements: tuple[ElementBaseline, ...]
    noise_scale: float
    began_ns: int


@dataclass(frozen=True)
class BoutCalibration:
    """Bout calibration over the DoF ladder: Type A per rung, and the trace over all rungs (with all `dof` joints in it)."""

    rungs: tuple[TypeA, ...]
    trace: Trace
    false_alarm_rate: float  # of the bout rule at the top rung: share of readings in clean air that it takes for a bout

    @property
    def last(self) -> TypeA:
        """Type A of the top rung of the DoF ladder."""
        return self.rungs[-1]


@dataclass(frozen=True)
class MapCalibration:
    """Fit on the known source (beacon), and the Type B uncertainty of locating it from repeats of five measurements."""

    fit: Fit
    repeats: tuple[Repeat, ...]
    type_b: TypeB
    ended_ns: int
    error_ppm: float
    moves: int
    delay: Delay
    gaps: StreamGaps  # in the gas samples since the run began
    box_sd_m: float  # standard deviation of a place anywhere in the workspace box


@dataclass(frozen=True)
class Kept:
    """A calibration of an earlier run: its file, the verdict on it, and remarks on where it may not fit this run."""

    file: str
    verdict: str
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class Calibration:
    """Priors of the filter: calibrated with the chosen assembly of Q and R, with the paper's, and not calibrated: nominal values taken as
    known (cold), or as open as before the fit on the beacon (cold_open)."""

    chosen: Prior
    paper: Prior
    cold: Prior
    cold_open: Prior
    noise: Noise
    time_s: float
    error_ppm: float
    u_a_ppm: float
    u_b_m: float
    moves: int
    baselines: tuple[ElementBaseline, ...]
    kept: Kept | None = None  # where it comes from, if not from this run


@dataclass(frozen=True)
class Navigation:
    """Record of the search: start and end, belief maps with their times (a re-run over the log uses the same), moves, outcome."""

    began_ns: int
    ended_ns: int
    maps_ns: tuple[int, ...]
    maps: tuple[tuple[Fit, ...], ...]
    move_ends_ns: tuple[int, ...]
    made: tuple[Move, ...]
    declared: bool
    source_m: tuple[float, ...]
    sd_m: float
    gaps: StreamGaps  # in the gas samples since the run began

    @property
    def moves(self) -> int:
        """Number of finished moves."""
        return len(self.move_ends_ns)
