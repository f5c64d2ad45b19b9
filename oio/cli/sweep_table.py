"""The table of a sweep, printed when a multirun ends, from the status.json and summary.json of its jobs."""

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hydra.experimental.callback import Callback
from omegaconf import DictConfig
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from oio.cli.console import number
from oio.cli.seed_table import show_groups, show_table_1
from oio.cli.table_1 import table_1

COLUMNS = (
    "job",
    "sensor",
    "dof",
    "air",
    "seed",
    "state",
    "cold [mm]",
    "calibrated [mm]",
    "in 95 %",
    "cal. time [s]",
    "u_a [ppm]",
    "wall [s]",
)
TEXT = ("job", "sensor", "air", "state")  # left-justified


class SweepTable(Callback):
    """Hydra callback at the end of a multirun; `failed` decides the exit code of the command."""

    failed = 0  # jobs of the last sweep of this process that did not finish

    def on_multirun_end(self, config: DictConfig, **kwargs: Any) -> None:
        """Print the table; jobs that left no status count as failed."""
        folder = Path(config.hydra.sweep.dir)
        rows = sweep_rows(folder)
        SweepTable.failed = sum(row["state"] != "done" for row in rows)
        show_sweep(rows, str(folder))
        if config.hydra.runtime.choices.get("experiment") == "table_1":
            conf = next(Path(source.path) for source in config.hydra.runtime.config_sources if source.provider == "main")
            show_table_1([row["summary"] for row in rows if row["summary"]], table_1(conf), Console())


def sweep_rows(folder: Path) -> list[dict[str, Any]]:
    """A row per job of a sweep: job, state, error and summary, in the order of the job numbers."""
    jobs = [path for path in folder.iterdir() if path.is_dir() and path.name.split("_")[0].isdigit()]
    return [_row(path) for path in sorted(jobs, key=lambda path: int(path.name.split("_")[0]))]


def _row(path: Path) -> dict[str, Any]:
    status, summary = _json(path / "status.json"), _json(path / "summary.json")
    state = status["state"] if status else "no status"
    return {"job": path.name, "state": state, "error": status.get("error") if status else None, "summary": summary}


def _json(path: Path) -> dict[str, Any] | None:
    if not path.is_file():
        return None
    loaded: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return loaded


def show_sweep(rows: Sequence[Mapping[str, Any]], where: str) -> None:
    """Print the table of a sweep; every row has job, state, error, and the summary if there is one."""
    table = Table(title=escape(f"{len(rows)} jobs, {where}"), title_justify="left")
    for head in COLUMNS:
        table.add_column(escape(head), justify="left" if head in TEXT else "right")
    for row in rows:
        table.add_row(*_cells(row))
    console = Console(width=None if sys.stdout.isatty() else 160)
    console.print(table)
    show_groups([row["summary"] for row in rows if row["summary"]], console)
    for row in rows:
        if row["error"]:
            console.print(f"job {row['job']}: {row['error']}", markup=False, soft_wrap=True)


def _cells(row: Mapping[str, Any]) -> list[str]:
    s = row["summary"]
    if s is None:
        return [escape(row["job"]), *[""] * 4, row["state"], *[""] * 6]
    cold, calibrated = (_missed(s[key]) for key in ("cold", "calibrated"))
    inside = {True: "yes", False: "no", None: "-"}[s["calibrated"]["inside_95"] if s["calibrated"] else None]
    calibration = s["calibration"] or {"time_s": None, "u_a_ppm": None}
    return [
        escape(row["job"]), s["sensor"], str(s["dof"]), s["air"], str(s["seed"]), row["state"], cold, calibrated, inside,
        number(calibration["time_s"], 1.0, 0), number(calibration["u_a_ppm"], 1.0, 2), number(s["wall_s"], 1.0),
    ]  # fmt: skip


def _missed(outcome: Mapping[str, Any] | None) -> str:
    if outcome is None:
        return "-"
    if outcome.get("bearing_error_deg") is not None:
        return f"{outcome['bearing_error_deg']:.1f} deg"
    return number(outcome["source_error_m"])
