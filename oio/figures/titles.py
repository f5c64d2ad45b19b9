"""Titles of a figure: configuration and result of the run, from summary.json where there is one."""

import json
from pathlib import Path
from typing import Any

from oio.core.errors import BadInput
from oio.results.summary import READABLE, SCHEMA

Document = dict[str, Any]
SIMULATION = "mujoco"
ONLY_SIMULATED = [("air {}", "air"), ("seed {}", "seed")]


def read_summary(path: Path) -> Document:
    """Read the summary of a run, {} if it has none; raises BadInput for a file that is something else."""
    if not path.is_file():
        return {}
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, OSError) as error:
        raise BadInput(f"{path} was given as a summary, but it cannot be read ({error}). {_REPAIR}") from None
    if not isinstance(document, dict) or document.get("schema") not in READABLE:
        raise BadInput(f"{path} was given as a summary, but it is not of schema {SCHEMA}. {_REPAIR}")
    return document


_REPAIR = "Remove it to draw the run from its log alone, or run the experiment again."


def headline(identity: Document, summary: Document) -> str:
    """Return the configuration of the run, e.g. `sensor ec, 5 DoF, air still, seed 3`; unknown entries are left out. Only a simulation
    knows its air."""
    known = {**identity, **{key: value for key, value in summary.items() if value is not None}}
    simulated = known.get("backend", SIMULATION) == SIMULATION
    words = [("sensor {}", "sensor"), ("{} DoF", "dof"), *(ONLY_SIMULATED if simulated else [("backend {}", "backend")])]
    return ", ".join(pattern.format(known[key]) for pattern, key in words if key in known)


def ending(summary: Document) -> str:
    """Return the result, e.g. `source error: cold start 85.0 mm -> calibrated 12.3 mm`; empty if nothing was scored."""
    for key, what, factor, unit in (("source_error_m", "source error", 1e3, "mm"), ("bearing_error_deg", "bearing error", 1.0, "deg")):
        cold, calibrated = number(summary, "cold", key), number(summary, "calibrated", key)
        if cold is not None and calibrated is not None:
            return f"{what}: cold start {factor * cold:.1f} {unit} \N{RIGHTWARDS ARROW} calibrated {factor * calibrated:.1f} {unit}"
    return ""


def number(summary: Document, *keys: str) -> float | None:
    """Return a nested number of a summary, or None."""
    value: Any = summary
    for key in keys:
        value = value.get(key) if isinstance(value, dict) else None
    return float(value) if isinstance(value, int | float) else None
