"""Tables over seeds of a sweep: calibrated against cold start per sensor, DoF and air; Table I beside the paper's."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from oio.sweep.table_1 import Published

Row = Mapping[str, Any]


def group_by_case(summaries: Sequence[Row]) -> dict[tuple[str, int, str], list[Row]]:
    """Summaries with a source error, by sensor, DoF and air."""
    groups: dict[tuple[str, int, str], list[Row]] = {}
    for s in summaries:
        if s["calibrated"] and s["cold"] and s["calibrated"]["source_error_m"] is not None:
            groups.setdefault((s["sensor"], s["dof"], s["air"]), []).append(s)
    return groups


def group_figures(runs: Sequence[Row]) -> dict[str, float]:
    """Medians and 90th percentile of the source error [m], runs in which calibrated beats cold, and coverage of the 95 % region."""
    error = np.array([[s[name]["source_error_m"] for name in ("cold", "calibrated")] for s in runs], dtype=float)
    return {
        "cold_m": float(np.median(error[:, 0])),
        "calibrated_m": float(np.median(error[:, 1])),
        "p90_m": float(np.quantile(error[:, 1], 0.9)),
        "beats": float(np.sum(error[:, 1] < error[:, 0])),
        "covered": float(np.mean([s["calibrated"]["inside_95"] for s in runs])),
        "time_s": float(np.median([s["calibration"]["time_s"] for s in runs])),
    }


def show_groups(summaries: Sequence[Row], console: Console) -> None:
    """Print a line per group of two or more seeds; nothing if there is none."""
    groups = {key: runs for key, runs in group_by_case(summaries).items() if len(runs) > 1}
    if not groups:
        return
    table = Table(title=escape("source error over seeds [mm]"), title_justify="left")
    for head in ("sensor", "dof", "air", "cold, median", "calibrated, median", "90 %", "beats cold", "in 95 %", "cal. time [s]"):
        table.add_column(escape(head), justify="left" if head in ("sensor", "air") else "right")
    for (sensor, dof, air), runs in groups.items():
        f = group_figures(runs)
        table.add_row(
            sensor, str(dof), air, f"{1e3 * f['cold_m']:.1f}", f"{1e3 * f['calibrated_m']:.1f}", f"{1e3 * f['p90_m']:.1f}",
            f"{f['beats']:.0f} of {len(runs)}", f"{100 * f['covered']:.0f} %", f"{f['time_s']:.0f}",
        )  # fmt: skip
    console.print(table)


def show_table_1(summaries: Sequence[Row], published: Mapping[str, Published], console: Console) -> None:
    """Medians over seeds of calibration time and error of every sensor, beside the paper's; for `+experiment=table_1`."""
    runs: dict[str, list[Row]] = {}
    for s in summaries:
        if s["calibration"]:
            runs.setdefault(s["sensor"], []).append(s["calibration"])
    table = Table(title="Table I: medians over seeds, beside the paper's", title_justify="left")
    for head in ("sensor", "seeds", "total calibration time, s", "paper", "error, ppm", "paper"):
        table.add_column(head, justify="left" if head == "sensor" else "right")
    for sensor, found in runs.items():
        paper = published.get(sensor)
        time_s, error_ppm = (float(np.median([c[key] for c in found])) for key in ("time_s", "error_ppm"))
        theirs = ("-", "-") if paper is None else (f"{paper.time_s:g}", f"{paper.error_ppm:g}")
        table.add_row(sensor, str(len(found)), f"{time_s:.0f}", theirs[0], f"{error_ppm:.1f}", theirs[1])
    console.print(table)
