"""The table of a sweep, printed when a multirun ends, from the status.json and summary.json of its jobs."""

import json
from pathlib import Path
from typing import Any

from hydra.experimental.callback import Callback
from omegaconf import DictConfig
from rich.console import Console

from oio.cli.console import show_sweep
from oio.cli.seed_table import show_table_1
from oio.cli.table_1 import table_1


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
