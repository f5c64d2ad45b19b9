"""A flat record per job: its folder, state, choices, overrides and the numbers of its summary; nothing that the clock decides."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from oio.sweep.manifest import Outcome

CHOICES = ("sensor", "profile", "dof", "air", "world", "ekf", "assembly", "backend", "seed")  # as summary.json has them
NOT_KEPT = ("schema", "wall_s", "reasons", "criteria", "verdicts")
RESULTS = (  # keys of summary.json that are results
    "job", "source_position_m", "calibration", "cold", "cold_open", "calibrated", "calibrated_paper_assembly", "dead_reckoning", "bound_m",
    "bound_ratio", "posterior_bound_m", "posterior_bound_ratio", "verdict", "scored", "reproducible", "protocol", "simulated_s",
    "distribution",
)  # fmt: skip
Record = dict[str, Any]


def records(outcomes: Sequence[Outcome]) -> list[Record]:
    """Return a record per job; what a job has no value for is missing."""
    rows = [_record(outcome) for outcome in outcomes]
    defaults: Record = {}  # choices that a job that is done did not make: those without a summary have them too
    for outcome, row in zip(outcomes, rows, strict=True):
        chosen = dict(_override(word) for word in outcome.job.words)
        if outcome.summary:
            defaults = {**{key: row[key] for key in CHOICES if key in row and key not in chosen}, **defaults}
    return [{**row, **{key: value for key, value in defaults.items() if key not in row}} for row in rows]


def _record(outcome: Outcome) -> Record:
    overrides = dict(_override(word) for word in outcome.job.words)
    told: Record = {"job": outcome.job.folder, "state": outcome.state, **overrides}
    for key, value in _flat(outcome.summary or {}):
        if key not in NOT_KEPT:
            told[key] = value
    return told


def _override(word: str) -> tuple[str, Any]:
    key, _, text = word.lstrip("+~").partition("=")
    try:
        return key, int(text)
    except ValueError:
        return key, text


def _flat(tree: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield dotted paths and values; lists as they are."""
    for key, value in tree.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{above}{key}.")
        else:
            yield f"{above}{key}", value


def overridden(row: Mapping[str, Any]) -> list[str]:
    """Return the keys of a record by which jobs differ on purpose: choices and overrides, no results."""
    return [key for key in row if key in ("state", *CHOICES) or key.split(".")[0] not in RESULTS]


def shown_error(row: Mapping[str, Any]) -> tuple[float, str]:
    """Return the calibrated error of a record as people read it, and its unit: mm, or deg."""
    error = error_of(row)
    assert error is not None
    return (1e3 * error, "mm") if row.get("calibrated.source_error_m") is not None else (error, "deg")


def error_of(record: Mapping[str, Any], outcome: str = "calibrated") -> float | None:
    """Return the error of a record: of the position in m, or of the bearing in degrees where the joints observe no more."""
    for key in ("source_error_m", "bearing_error_deg"):
        value = record.get(f"{outcome}.{key}")
        if value is not None:
            return float(value)
    return None
