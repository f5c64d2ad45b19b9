"""What the launchers of `hydra_plugins.oio_launchers` do: jobs are matched with those of the folder, run, and returned to Hydra."""

import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

from hydra.core.utils import JobReturn
from omegaconf import DictConfig

from oio.cli.plugins import FOLDER, absolute
from oio.core.errors import BadInput
from oio.sweep.dask_cluster import DaskCluster
from oio.sweep.engine import Engine, InThisProcess, WorkerProcesses
from oio.sweep.fingerprint import folders_of, version_of_everything
from oio.sweep.folder_names import FolderNames
from oio.sweep.manifest import LAUNCHED, MANIFEST, Job, Manifest, locked
from oio.sweep.objective import returned
from oio.sweep.store import Store
from oio.sweep.sweep import adopt_version, run_sweep

ENGINES: Mapping[str, Callable[..., Engine]] = {"basic": InThisProcess, "joblib": WorkerProcesses, "dask": DaskCluster}
COUNTS = ("processes", "workers", "retries")  # settings that are whole numbers


def launch(
    config: DictConfig, overrides: Sequence[Sequence[str]], first: int, launcher: str, settings: Mapping[str, Any],
    objective: str | None, seeds: Sequence[int],
) -> list[JobReturn]:  # fmt: skip
    """Run the jobs with these overrides into hydra.sweep.dir; numbers of new ones begin at `first` or above.

    With `seeds`, each of the overrides is run with each of them, and returns the median of the objective.
    """
    folder, places = Path(config.hydra.sweep.dir), search_places(config)
    version = version_of_everything(folders_of(places))
    if config.cache not in ("on", "off"):
        raise BadInput(f"cache={config.cache} was given, but cache can be on or off. Type e.g. cache=off.")
    with locked(folder):
        manifest = _manifest(folder, version)
        adopt_version(manifest, version)
        asked = [words for group in overrides for words in _with_seeds(group, seeds)]
        jobs = _matched(manifest, asked, first, FolderNames(config, places))
        manifest.command, manifest.launcher, manifest.places = sys.argv[1:], {"name": launcher, **settings}, list(places)
        manifest.cache = config.cache
        outcomes = run_sweep(manifest, jobs, engine_of(manifest.launcher), Store.of(manifest, places), places)
    LAUNCHED.extend(outcomes)
    each = max(len(seeds), 1)
    return [returned(outcomes[i : i + each], words, objective) for i, words in zip(range(0, len(outcomes), each), overrides, strict=True)]


def _with_seeds(words: Sequence[str], seeds: Sequence[int]) -> list[Sequence[str]]:
    """The overrides with each seed; without those that do not change a run."""
    plain = [word for word in words if not word.startswith("cache=")]
    others = [word for word in plain if not word.startswith("seed=")]
    return [[*others, f"seed={seed}"] for seed in seeds] or [plain]


def engine_of(launcher: Mapping[str, Any]) -> Engine:
    """Return the engine of a launcher, by its name and settings as they stand in sweep.json. Raises BadInput if they make none."""
    settings = {key: value for key, value in launcher.items() if key != "name"}
    counts = [settings[key] for key in COUNTS if key in settings]
    try:
        if not all(isinstance(count, int) and count >= 0 for count in counts):
            raise ValueError("not a whole number")
        return ENGINES[launcher["name"]](**settings)
    except (KeyError, TypeError, ValueError):
        given = f"{MANIFEST} names the launcher {dict(launcher)}, which is none that can be used here"
        raise BadInput(f"{given}. Nothing was run; type --jobs 2 for processes of this machine.") from None


def search_places(config: DictConfig) -> tuple[str, ...]:
    """Return the folders and packages on Hydra's search path besides the project's own."""
    sources = (source.path for source in config.hydra.runtime.config_sources if source.provider == "command-line")
    return tuple(absolute(place) for place in (*(f"{FOLDER}{path}" for path in sources), *map(str, config.hydra.searchpath)))


def _manifest(folder: Path, version: str) -> Manifest:
    if (folder / MANIFEST).exists():
        return Manifest.read(folder)
    run = next((path for path in sorted(folder.glob("*/status.json"))), None)
    if run is not None:
        raise BadInput(f"{folder} holds runs that are of no sweep known here (e.g. {run.parent.name}). Give another hydra.sweep.dir.")
    return Manifest(folder, version)


def _matched(manifest: Manifest, overrides: Sequence[Sequence[str]], first: int, names: FolderNames) -> list[Job]:
    """Return a job for each list of overrides: the one of the folder that has the same, or a new one."""
    known = {job.key: job for job in manifest.jobs}
    number = max([first, *(job.number + 1 for job in manifest.jobs)])
    jobs = []
    for words in overrides:
        job = Job(number, tuple(words), names.of(number, words))
        found = known.setdefault(job.key, job)
        number += found is job
        jobs.append(found)
    _check_folders(list(known.values()))
    manifest.jobs = list(known.values())
    return jobs


def _check_folders(jobs: Sequence[Job]) -> None:
    """Raise BadInput if two jobs share a folder, or one lies elsewhere."""
    taken: dict[PurePosixPath, Job] = {}
    for job in jobs:
        path = PurePosixPath(job.folder)
        if path.is_absolute() or ".." in path.parts or not path.parts or taken.setdefault(path, job) is not job:
            given = f"hydra.sweep.subdir gives '{job.folder}' for job {job.number}"
            raise BadInput(f"{given}, but every job needs a folder of its own in the sweep's. Leave hydra.sweep.subdir out.")
