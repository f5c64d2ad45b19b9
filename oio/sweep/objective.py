"""What a sweep returns to a sweeper of Hydra: summaries, or the number that it optimises."""

import statistics
from collections.abc import Mapping, Sequence
from typing import Any

from hydra.core.utils import JobReturn, JobStatus

from oio.core.errors import BadInput, OioError
from oio.sweep.manifest import Outcome


def returned(outcomes: Sequence[Outcome], words: Sequence[str], objective: str | None) -> JobReturn:
    """Return the result of one combination of values: of its runs, which differ in the seed, the median of the objective."""
    told = JobReturn(overrides=list(words), status=JobStatus.COMPLETED)
    failed = next((outcome for outcome in outcomes if outcome.summary is None), None)
    if objective is None:
        told.return_value = outcomes[0].summary
    elif failed is not None:
        told.status, told.return_value = JobStatus.FAILED, OioError(f"job {failed.job.folder}: {failed.error or failed.state}")
    else:
        told.return_value = statistics.median(_entry(outcome.summary or {}, objective) for outcome in outcomes)
    return told


def _entry(summary: Mapping[str, Any], path: str) -> float:
    """Return a number of a summary by its dotted path."""
    value: Any = summary
    for key in path.split("."):
        value = value.get(key) if isinstance(value, Mapping) else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        given = f"hydra.launcher.objective={path} was given, but that is no number of summary.json"
        raise BadInput(f"{given}. Type e.g. hydra.launcher.objective=calibrated.source_error_m.")
    return float(value)
