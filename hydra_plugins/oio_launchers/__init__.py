"""Hydra's doors to `oio.sweep`: Hydra loads launchers and sweepers from packages below `hydra_plugins` only.

Light to import: Hydra imports every plugin at the start of every command.
"""

import importlib.util
import os
from collections.abc import Sequence
from typing import Any

from hydra._internal.core_plugins.basic_sweeper import BasicSweeper
from hydra.core.config_store import ConfigStore
from hydra.core.utils import JobReturn
from hydra.plugins.launcher import Launcher
from hydra.types import HydraContext, TaskFunction
from omegaconf import DictConfig

from oio.core.errors import BadInput


class Grid(BasicSweeper):
    """All combinations of the swept values. Hydra's own composes every job before the first begins; here
    `oio.cli.sweep_check` has checked them.
    """

    def validate_batch_is_legal(self, batch: Sequence[Sequence[str]]) -> None:
        """Nothing is left to check."""


class _Sweep(Launcher):
    """Jobs by an engine of `oio.sweep`."""

    def __init__(self, objective: str | None, objective_seeds: Sequence[int] | None, **settings: Any) -> None:
        self.objective, self.seeds, self.settings = objective, tuple(objective_seeds or ()), settings

    def setup(self, *, hydra_context: HydraContext, task_function: TaskFunction, config: DictConfig) -> None:
        """Keep the configuration of the sweep; the jobs compose their own."""
        self.config = config

    def launch(self, job_overrides: Sequence[Sequence[str]], initial_job_idx: int) -> Sequence[JobReturn]:
        """Run the jobs that are not done, and return what they are worth to a sweeper."""
        from oio.sweep import launch

        return launch.launch(self.config, job_overrides, initial_job_idx, self.name, self.settings, self.objective, self.seeds)

    name: str


class OneByOne(_Sweep):
    """`hydra/launcher=basic`, the default."""

    name = "basic"


class Processes(_Sweep):
    """`hydra/launcher=joblib`."""

    name = "joblib"

    def __init__(self, backend: str, n_jobs: int, retries: int, **objective: Any) -> None:
        if backend != "loky":
            given = f"hydra.launcher.backend={backend} was given, but jobs run in processes of backend=loky only"
            raise BadInput(f"{given}. Leave it out, or type hydra/launcher=dask for more than one machine.")
        super().__init__(**objective, processes=_at_a_time(n_jobs), retries=_whole("retries", retries))


class Dask(_Sweep):
    """`hydra/launcher=dask`."""

    name = "dask"

    def __init__(self, address: str | None, n_jobs: int, memory_limit: str, retries: int, collect: str, **objective: Any) -> None:
        if importlib.util.find_spec("distributed") is None:
            raise BadInput("hydra/launcher=dask needs the package distributed. Type: pip install 'oio[dask]'.")
        if collect not in ("all", "summary"):
            given = f"hydra.launcher.collect={collect} was given, but collect is all or summary (the log stays where the job ran)"
            raise BadInput(f"{given}. Type e.g. hydra.launcher.collect=all.")
        retries = _whole("retries", retries)
        super().__init__(
            **objective, address=address, workers=_at_a_time(n_jobs), memory_limit=memory_limit, retries=retries, collect=collect
        )


def _at_a_time(n_jobs: object) -> int:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if not isinstance(n_jobs, int) or n_jobs == 0 or n_jobs < -1:
        given = f"hydra.launcher.n_jobs={n_jobs} was given, but it is 1 or more, or -1 for all cores"
        raise BadInput(f"{given}. Type e.g. hydra.launcher.n_jobs={cores}.")
    return cores if n_jobs == -1 else n_jobs


def _whole(key: str, value: object) -> int:
    if not isinstance(value, int) or value < 0:
        raise BadInput(f"hydra.launcher.{key}={value} was given, but it is a whole number, 0 or more. Type e.g. hydra.launcher.{key}=2.")
    return value


OBJECTIVE = {
    "objective": None,  # what a job returns to a sweeper that optimises: an entry of summary.json, e.g. calibrated.source_error_m,
    "objective_seeds": None,  # the median over runs with these seeds; null: of the one run
}
CHOICES = {
    ("hydra/sweeper", "basic"): {"_target_": f"{__name__}.Grid", "max_batch_size": None, "params": None},
    ("hydra/launcher", "basic"): {"_target_": f"{__name__}.OneByOne", **OBJECTIVE},
    ("hydra/launcher", "joblib"): {"_target_": f"{__name__}.Processes", "backend": "loky", "n_jobs": -1, "retries": 2, **OBJECTIVE},
    ("hydra/launcher", "dask"): {
        "_target_": f"{__name__}.Dask",
        "address": None,  # of the scheduler of a cluster that runs, e.g. tcp://10.0.0.5:8786; null: a cluster on this machine
        "n_jobs": -1,  # workers of a cluster on this machine; -1: as many as there are cores
        "memory_limit": "auto",  # of such a worker; beyond it Dask restarts it, and its job is tried again
        "retries": 2,  # of a job whose worker died
        "collect": "all",  # files that come back from a worker: all, or summary (everything but the log, which stays there)
        **OBJECTIVE,
    },
}


def register() -> None:
    """Register the choices, in place of those of the same names that Hydra and its joblib plugin may have registered."""
    for (group, name), keys in CHOICES.items():
        ConfigStore.instance().store(group=group, name=name, node=keys, provider="oio")


register()
