"""Table I of the paper, calibration time and error of every sensor, and ours beside it."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml
from rich.console import Console

from oio.cli.table_layout import print_table


class Published(NamedTuple):
    """What the paper gives for one sensor: total calibration time [s] and error [ppm]."""

    time_s: float
    error_ppm: float


def table_1(conf: Path) -> dict[str, Published]:
    """By sensor, from the folder of the configuration."""
    rows = yaml.safe_load((conf / "table_1.yaml").read_text(encoding="utf-8"))
    return {sensor: Published(**row) for sensor, row in rows.items()}


def show_table_1(summaries: Sequence[Mapping[str, Any]], published: Mapping[str, Published], console: Console) -> None:
    """Medians over seeds of calibration time and error of every sensor, beside the paper's; for `+experiment=table_1`."""
    runs: dict[str, list[Mapping[str, Any]]] = {}
    for s in summaries:
        if s["calibration"]:
            runs.setdefault(s["sensor"], []).append(s["calibration"])
    rows = []
    for sensor, found in runs.items():
        paper = published.get(sensor)
        time_s, error_ppm = (float(np.median([c[key] for c in found])) for key in ("time_s", "error_ppm"))
        theirs = ("-", "-") if paper is None else (f"{paper.time_s:g}", f"{paper.error_ppm:g}")
        rows.append([sensor, str(len(found)), f"{time_s:.0f}", theirs[0], f"{error_ppm:.1f}", theirs[1]])
    heads = ("sensor", "seeds", "total calibration time, s", "paper", "error, ppm", "paper")
    print_table(console, "Table I: medians over seeds, beside the paper's", heads, rows)
