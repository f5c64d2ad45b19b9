"""Result records that stages pass to each other: warm-up, baseline, calibration, and the search."""

from dataclasses import dataclass

from oio.gas.bouts import ElementBaseline
from oio.gas.exposures import Exposures
from oio.gas.timing import Delay
from oio.gas.trace import Trace
from oio.identification.allan_slope import EndSlope
from oio.inference.beacon_repeats import Repeat
from oio.inference.map_fit import Fit
from oio.inference.prior import Prior
from oio.inference.rise_and_fall import RiseAndFall
from oio.inference.uncertainty import Noise, TypeA, TypeB
from oio.motion.guard_account import GuardAccount
from oio.runtime.gas_stream import StreamGaps
from oio.search.view import Move


@dataclass(frozen=True)
class WarmUpResult:
    """Result of warm-up: waiting time [s], last slope of each element [ppm/min] with its standard error, noise scale of the window, the
    slope below which the sensor counts as at rest, and the drift of the clean air recorded afterwards, None without a record."""

    waited_s: float
    slope_ppm_per_min: tuple[float, ...]
    slope_u_ppm_per_min: tuple[float, ...]
    noise_ratios: tuple[float, ...]  # of each element: variance about the fitted line over the sensor's nominal variance
    readings: int
    rest_ppm_per_min: float
    drift: EndSlope | None

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
    lags: RiseAndFall  # by the readings alone
    exposures: Exposures  # to the beacon, and what the bout rule made of them
    highest_ppm: tuple[float, ...]  # signal of each element above clean air, since the beacon was open
    guard: GuardAccount | None  # of the arm so far; None without an arm that moves


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
    highest_ppm: tuple[float, ...] | None  # signal of each element above clean air; None of a file that does not say
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
    gas_ppm: tuple[float, ...]  # signal of each element above clean air below which 95 % of its readings in gas are
    guard: GuardAccount | None  # of the arm since the run began; None without an arm that moves

    @property
    def moves(self) -> int:
        """Number of finished moves."""
        return len(self.move_ends_ns)
