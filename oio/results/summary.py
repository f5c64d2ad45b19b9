"""Writer of summary.json, schema oio.results.summary/2: the interface to other tools."""

import dataclasses
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass

from oio.inference.map_fit import CALIBRATED
from oio.inference.metrics import ResidualTest
from oio.results.calibration import Calibration
from oio.results.criteria.judgement import CALIBRATION, SEARCH, Verdict

SCHEMA = "oio.results.summary/2"
ABOUT = (CALIBRATION, SEARCH)
READABLE = ("oio.results.summary/1", SCHEMA)  # schema 2 adds fields to schema 1; its verdict no longer knows the truth


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
    cannot see, as sentences, the number of joints, and the standard deviation of a place somewhere in the workspace box [m]."""

    residuals: ResidualTest | None
    unseen: tuple[str, ...]
    dof: int
    box_sd_m: float


@dataclass(frozen=True, slots=True)
class Scored:
    """Comparison with the truth: RIGHT (inside the 99.9 % region), WRONG or `unknown`, with remarks. It never enters the verdict."""

    word: str
    reasons: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Reproducible:
    """Whether a run may be called reproducible (`yes` or `no`), and the reasons for a no."""

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


def summary(
    identity: dict[str, object],
    calibration: Calibration | None,
    found: Evaluation | None,
    verdict: Verdict,
    wall_s: float,
    reproducible: Reproducible | None = None,
    protocol: Mapping[str, object] | None = None,
) -> dict[str, object]:
    """Return the document. `identity`: sensor, profile, dof, backend, air, world, ekf, assembly, seed. Stages that did
    not run give null, as does a `reproducible` that nobody asked for (benchmarks) and the
    `protocol` of a run without one."""
    return {
        "schema": SCHEMA,
        **identity,
        "source_position_m": None if found is None or found.source_m is None else list(found.source_m),
        "calibration": None if calibration is None else _calibration(calibration),
        "cold": _outcome(found.cold if found else None),
        "cold_open": _outcome(found.cold_open if found else None),
        "calibrated": _outcome(found.calibrated if found else None),
        "calibrated_paper_assembly": _outcome(found.calibrated_paper_assembly if found else None),
        "dead_reckoning": {"nose_error_m": found.dead_reckoning_m if found else None},
        "bound_m": found.bound_m if found else None,
        "bound_ratio": found.bound_ratio if found else None,
        "posterior_bound_m": found.posterior_bound_m if found else None,
        "posterior_bound_ratio": found.posterior_bound_ratio if found else None,
        "verdict": verdict.word,
        "verdicts": {about: verdict.of(about).word for about in ABOUT if verdict.of(about).judgements},
        "reasons": list(verdict.reasons),
        "criteria": [dataclasses.asdict(judgement) for judgement in verdict.judgements],
        "scored": {"word": found.scored.word, "reasons": list(found.scored.reasons)} if found else None,
        "reproducible": {"word": reproducible.word, "reasons": list(reproducible.reasons)} if reproducible else None,
        "protocol": protocol,
        "simulated_s": found.simulated_s if found else None,
        "wall_s": round(wall_s, 3),
    }


def to_json(document: dict[str, object]) -> str:
    """Serialise to strict JSON: non-finite numbers become null."""
    return json.dumps(_finite(document), indent=2, allow_nan=False) + "\n"


def _calibration(c: Calibration) -> dict[str, object]:
    made: dict[str, object] = {"time_s": c.time_s, "error_ppm": c.error_ppm, "u_a_ppm": c.u_a_ppm, "u_b_m": c.u_b_m, "moves": c.moves}
    return made if c.kept is None else {**made, "kept": dataclasses.asdict(c.kept)}


def _outcome(outcome: Outcome | None) -> dict[str, object] | None:
    if outcome is None:
        return None
    fields = dataclasses.asdict(outcome)
    if outcome.bearing_error_deg is None:
        del fields["bearing_error_deg"]
    return fields


def _finite(value: object) -> object:
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
