"""The table of a sweep by groups of jobs: errors with bootstrap intervals, coverage, declarations."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from oio.core.errors import BadInput
from oio.sweep.bootstrap import interval
from oio.sweep.records import CHOICES, Record, error_of, overridden

BY = ("sensor", "dof", "air")  # unless the user says otherwise, and what else differs
HEADS = {  # columns and what they mean
    "jobs": "jobs of the group", "failed": "jobs that are not done",
    "unit": "mm: of the position; deg: of the bearing, with one or two joints",
    "cold": "median error of the cold start",
    "median": "median error, calibrated; median_low, median_high: its 95 % interval (bootstrap)",
    "p90": "90th percentile of that error; p90_low, p90_high: its 95 % interval",
    "beats": "share of jobs in which calibrated is nearer than cold",
    "inside_95": "share of jobs whose 95 % region contains the source", "declared": "share of jobs that declared the source",
    "calibration_s": "median calibration time",
}  # fmt: skip


def group_table(rows: Sequence[Record], by: Sequence[str] | None) -> list[dict[str, Any]]:
    """Return a row per group, in the order of the first job of each. `by`: keys of records; None: sensor, dof, air, and what differs."""
    known = sorted({key for row in rows for key in overridden(row)})
    keys = list(by) if by is not None else usual_keys(rows)
    for key in keys:
        if key not in known:
            raise BadInput(f"--by {key} was given, but jobs can be grouped by {', '.join(known)} only. Type e.g. --by sensor,dof,air.")
    groups: dict[tuple[str, ...], list[Record]] = {}
    for row in rows:
        groups.setdefault(tuple(str(row.get(key, "")) for key in keys), []).append(row)
    return [{**dict(zip(keys, group, strict=True)), **_figures(members)} for group, members in groups.items()]


def usual_keys(rows: Sequence[Record]) -> list[str]:
    """Sensor, DoF, air, and every choice but the seed of which there are several."""
    several = [key for key in CHOICES if key not in (*BY, "seed") and len({str(row[key]) for row in rows if key in row}) > 1]
    return [*BY, *several] if all(any(key in row for row in rows) for key in BY) else ["state"]


def _figures(members: Sequence[Record]) -> dict[str, Any]:
    done = [row for row in members if row["state"] == "done"]
    scored = [row for row in done if error_of(row) is not None]
    position = bool(scored) and scored[0].get("calibrated.source_error_m") is not None
    factor = 1e3 if position else 1.0
    errors = factor * np.array([error_of(row) for row in scored], dtype=float)
    cold = factor * np.array([error_of(row, "cold") for row in scored], dtype=float)
    (low, high), (low_90, high_90) = interval(errors, np.median), interval(errors, _p90)
    return {
        "jobs": len(members), "failed": len(members) - len(done), "unit": ("mm" if position else "deg") if scored else "",
        "cold": _of(cold, np.nanmedian), "median": _of(errors, np.median), "median_low": low, "median_high": high,
        "p90": _of(errors, _p90), "p90_low": low_90, "p90_high": high_90,
        "beats": _of(errors < cold, np.mean), "inside_95": _share(done, "calibrated.inside_95"),
        "declared": _share(done, "calibrated.found"),
        "calibration_s": _of(np.array([row["calibration.time_s"] for row in done if "calibration.time_s" in row], dtype=float), np.median),
    }  # fmt: skip


def _p90(values: Any, axis: int = -1) -> Any:
    return np.quantile(values, 0.9, axis=axis)


def _of(values: Any, statistic: Any) -> float:
    return float(statistic(values)) if len(values) and not np.all(np.isnan(np.asarray(values, dtype=float))) else float("nan")


def _share(rows: Sequence[Mapping[str, Any]], key: str) -> float:
    return _of(np.array([row[key] for row in rows if row.get(key) is not None], dtype=float), np.mean)
