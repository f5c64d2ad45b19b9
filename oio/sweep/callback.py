"""Hydra's callback at the end of a sweep: the table is printed, and failures are told."""

from pathlib import Path
from typing import Any

from hydra.experimental.callback import Callback
from omegaconf import DictConfig

from oio.cli import terminal
from oio.cli.outcome import FAILED
from oio.cli.run_folder import SUMMARY, read_json, state_of
from oio.core.errors import OioError
from oio.sweep.job_table import show_sweep
from oio.sweep.manifest import LAUNCHED, Job, Outcome
from oio.sweep.table_1 import show_table_1, table_1


class SweepTable(Callback):
    """Prints the table of the jobs that this command asked for, whether they ran now or before; failures decide the exit code."""

    def on_multirun_end(self, config: DictConfig, **kwargs: Any) -> None:
        """Print the table; jobs that left no status count as failed."""
        folder = Path(config.hydra.sweep.dir)
        outcomes = list(LAUNCHED) or _by_folder(folder)
        LAUNCHED.clear()
        show_sweep(outcomes, str(folder))
        if config.hydra.runtime.choices.get("experiment") == "table_1":
            conf = next(Path(source.path) for source in config.hydra.runtime.config_sources if source.provider == "main")
            show_table_1([outcome.summary for outcome in outcomes if outcome.summary], table_1(conf), terminal.console())
        failed = sum(outcome.state != "done" for outcome in outcomes)
        if failed:
            FAILED.append(OioError(f"{failed} jobs of the sweep failed; their status.json says why."))


def _by_folder(folder: Path) -> list[Outcome]:
    """The jobs of a launcher of others, by the numbers that head the names of their folders."""
    paths = [path for path in folder.iterdir() if path.is_dir() and path.name.split("_")[0].isdigit()]
    jobs = sorted((Job(int(path.name.split("_")[0]), (), path.name) for path in paths), key=lambda job: job.number)
    return [Outcome(job, *state_of(folder / job.folder), read_json(folder / job.folder / SUMMARY)) for job in jobs]
