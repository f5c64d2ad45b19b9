"""sweep.json: the jobs of a sweep's folder, the command that made them, and the version of code and configuration that they are of."""

import fcntl
import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import IO, Any

from oio.cli import git_state
from oio.cli.experiment import versions
from oio.cli.input_files import hash_of
from oio.cli.run_folder import SUMMARY, is_locked, read_json, state_of, write_whole
from oio.core.errors import BadInput

MANIFEST, SWEEP_LOCK, SCHEMA = "sweep.json", "sweep.lock", "oio.sweep/1"
INPUTS = "inputs.json"  # in a job's folder, if it reads files: their names and hashes


@dataclass(frozen=True, slots=True)
class Job:
    """One run of a sweep: its number, its overrides without those of `hydra`, and its folder below the sweep's."""

    number: int
    words: tuple[str, ...]
    folder: str

    @property
    def key(self) -> tuple[str, ...]:
        """What makes the run: its overrides in any order."""
        return tuple(sorted(self.words))


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a job ended: its state (see `oio.cli.run_folder.state_of`), the error, and its summary if it is done."""

    job: Job
    state: str
    error: str | None
    summary: dict[str, Any] | None


LAUNCHED: list[Outcome] = []  # how the jobs of this command ended, for the table at its end


@dataclass
class Manifest:
    """The jobs of a sweep's folder. Folders of jobs that are not in it do not belong to the sweep."""

    folder: Path
    version: str
    command: list[str] = field(default_factory=list)  # the last one: its words after `python -m oio.run`
    launcher: dict[str, Any] = field(default_factory=lambda: {"name": "basic"})  # name and settings
    places: list[str] = field(default_factory=list)  # further folders on Hydra's search path
    cache: str = "on"  # whether runs of earlier sweeps are taken
    jobs: list[Job] = field(default_factory=list)
    made_with: list[dict[str, str]] = field(default_factory=list)  # commit and versions of every process that ran jobs, each once

    @classmethod
    def read(cls, folder: Path) -> "Manifest":
        """Read sweep.json. Raises BadInput if there is none."""
        read = read_json(folder / MANIFEST)
        if read is None or read.get("schema") != SCHEMA:
            raise BadInput(f"{folder} holds no sweep ({MANIFEST}). Give the folder of one, as `python -m oio.run -m` tells it at the end.")
        try:
            jobs = [_job(job, folder) for job in read["jobs"]]
            made_with = [{str(name): str(told) for name, told in one.items()} for one in read.get("made_with", [])]
            return cls(folder, read["version"], read["command"], read["launcher"], read["places"], read["cache"], jobs, made_with)
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise BadInput(f"{folder / MANIFEST} cannot be read ({error!r}). Nothing was run; give another folder.") from None

    def note_code(self) -> None:
        """Note the commit and the versions of this process, which runs jobs."""
        told = {"git": git_state.commit(), **versions()}
        if told not in self.made_with:
            self.made_with.append(told)

    def write(self) -> None:
        """Write sweep.json, whole or not at all."""
        jobs = [{"number": job.number, "overrides": list(job.words), "folder": job.folder} for job in self.jobs]
        about = {"version": self.version, "command": self.command, "launcher": self.launcher, "places": self.places, "cache": self.cache}
        told = {"schema": SCHEMA, **about, "made_with": self.made_with, "jobs": jobs}
        write_whole(self.folder / MANIFEST, json.dumps(told, indent=1) + "\n")

    def outcome(self, job: Job) -> Outcome:
        """Return how a job stands. One whose input files have changed since is `outdated`."""
        path = self.folder / job.folder
        state, error = state_of(path)
        if state != "done":
            return Outcome(job, state, error, None)
        summary, inputs = read_json(path / SUMMARY), read_json(path / INPUTS) or {}
        changed = next((name for name, told in inputs.items() if hash_of(Path(name)) != told), None)
        if changed is not None:
            return Outcome(job, "outdated", f"{changed} has changed since this job read it", None)
        return Outcome(job, state, None, summary) if summary else Outcome(job, "killed", "its summary.json cannot be read", None)

    def outcomes(self) -> list[Outcome]:
        """Return how all jobs stand, in the order of their numbers."""
        return [self.outcome(job) for job in sorted(self.jobs, key=lambda job: job.number)]


def _job(told: dict[str, Any], folder: Path) -> Job:
    """Read one job. The file is data: a class to build, or a folder elsewhere, is refused."""
    job = Job(int(told["number"]), tuple(map(str, told["overrides"])), str(told["folder"]))
    path = PurePosixPath(job.folder)
    if path.is_absolute() or ".." in path.parts or not path.parts:
        raise BadInput(f"{folder / MANIFEST} names the folder '{job.folder}' for a job, which is not in the sweep's. Nothing was run.")
    if any("_target_" in word for word in job.words):
        raise BadInput(f"{folder / MANIFEST} has an override with _target_: anybody could choose what is built. Nothing was run.")
    return job


@contextmanager
def locked(folder: Path) -> Iterator[IO[str]]:
    """Hold the lock of a sweep's folder. Raises BadInput if another process runs a sweep there."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / SWEEP_LOCK).open("w", encoding="utf-8") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            told = f"a sweep is running in {folder} just now"
            raise BadInput(f"{told}. See it with python -m oio.sweep status {folder}, or give another hydra.sweep.dir.") from None
        yield file  # the file stays: to remove it would let two processes hold locks of one name


def is_running(folder: Path) -> bool:
    """Whether a process runs a sweep in this folder."""
    return is_locked(folder / SWEEP_LOCK)
