"""Writer of summary.json, schema oio.results.summary/2: the interface to other tools."""

import dataclasses
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass

from oio.results.calibration import Calibration
from oio.results.criteria.judgement import CALIBRATION, SEARCH, Verdict
from oio.results.evaluation import Evaluation, Outcome

SCHEMA = "oio.results.summary/2"
ABOUT = (CALIBRATION, SEARCH)
READABLE = ("oio.results.summary/1", SCHEMA)  # schema 2 adds fields to schema 1; its verdict no longer knows the truth


@dataclass(frozen=True, slots=True)
class Reproducible:
    """Whether a run may be called reproducible (`yes` or `no`), and the reasons for a no."""

    word: str
    reasons: tuple[str, ...]


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
