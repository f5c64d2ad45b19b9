"""Results of the stage `evaluate`: scores of every filter variant on the samples of the search, and what a bench can see of it."""

from dataclasses import dataclass

from oio.inference.map_fit import CALIBRATED
from oio.inference.metrics import ResidualTest


@dataclass(frozen=True, slots=True)
class Place:
    """Another place that the last map of the search left for the source: where [m], standard deviation, in what world, and the NEES of the
    source there, None without a truth."""

    believed_m: tuple[float, ...]
    sd_m: float
    world: str
    nees_source: float | None


@dataclass(frozen=True, slots=True)
class Outcome:
    """Scores of one filter variant on the samples of the search; None where truth or observability is missing."""

    source_error_m: float | None
    bearing_error_deg: float | None  # instead of source_error_m where the DoF cannot observe a position
    nose_error_m: float | None  # RMS since the first map of the search
    nees_source: float | None
    inside_95: bool | None
    nis_mean: float | None
    moves: int
    time_s: float
    found: bool  # declared by its own stop rule, which does not use the truth
    final_nose_to_source_m: float | None
    believed_m: tuple[float, ...] | None
    sd_m: float | None
    filtered_error_m: float | None = None  # source error and NEES of the filter alone, just before the last map
    filtered_nees: float | None = None
    world: str = CALIBRATED  # that the best hypothesis of the last map assumes
    other_places: tuple[Place, ...] = ()  # that it leaves besides the best: the answer is one of them while there are any

    def in_words(self) -> str:
        """Return the main score as a short text."""
        if self.source_error_m is not None:
            return f"source error {1e3 * self.source_error_m:.1f} mm"
        if self.bearing_error_deg is not None:
            return f"bearing error {self.bearing_error_deg:.1f} deg"
        return "no truth to compare with"


@dataclass(frozen=True, slots=True)
class Findings:
    """What a bench can see of a search besides the scores of its filter: the residuals of the last map (None without one), what the motion
    cannot see, as sentences, the number of joints, the standard deviation of a place somewhere in the workspace box [m], and how many
    readings had an innovation of the calibrated filter, and how many of those its gate rejected."""

    residuals: ResidualTest | None
    unseen: tuple[str, ...]
    dof: int
    box_sd_m: float
    innovations: int
    gated: int


@dataclass(frozen=True, slots=True)
class Scored:
    """Comparison with the truth: RIGHT (inside the 99.9 % region), WRONG or `unknown`, with remarks. It never enters the verdict."""

    word: str
    reasons: tuple[str, ...]


@dataclass(frozen=True)
class Evaluation:
    """All results of the `evaluate` stage."""

    cold: Outcome  # nominal values taken as known
    cold_open: Outcome  # nominal values as open as before the fit on the beacon
    calibrated: Outcome
    calibrated_paper_assembly: Outcome | None  # None if not requested
    dead_reckoning_m: float | None
    bound_m: float | None  # Cramer-Rao bound at the truth
    posterior_bound_m: float | None  # posterior Cramer-Rao (van Trees) bound, mean over truths drawn from the prior
    findings: Findings
    scored: Scored
    source_m: tuple[float, ...] | None
    simulated_s: float
    bounds: tuple[tuple[float, float], ...] = ()  # time [s] and Cramer-Rao bound [m] of the readings up to it; () without a truth

    @property
    def bound_ratio(self) -> float | None:
        """Source error of the calibrated filter over the Cramer-Rao bound: about 1 for an efficient estimator."""
        return self._error_over(self.bound_m)

    @property
    def posterior_bound_ratio(self) -> float | None:
        """Source error of the calibrated filter over the posterior Cramer-Rao (van Trees) bound."""
        return self._error_over(self.posterior_bound_m)

    def _error_over(self, bound_m: float | None) -> float | None:
        error = self.calibrated.source_error_m
        return None if error is None or not bound_m else error / bound_m
