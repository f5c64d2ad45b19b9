"""The sweep: what is done is not done again, what failed or was stopped is, and everything is told before it begins."""

import shutil
import statistics
import sys
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from oio.cli.count_progress import CountProgress, in_words
from oio.cli.first_compile import first_compile
from oio.core import interrupt
from oio.core.errors import BadInput
from oio.sweep.attempts import set_aside
from oio.sweep.engine import Engine
from oio.sweep.manifest import Job, Manifest, Outcome
from oio.sweep.store import Store
from oio.sweep.worker import Work

AGAIN = {"failed": "failed", "interrupted": "were stopped", "killed": "were killed", "outdated": "read files that have changed since"}
BYTES_PER_JOB = {"full": 3_000_000, "summary": 100_000}  # by `logging`: a run of the default configuration leaves 1.7 MB, or 26 kB


def adopt_version(manifest: Manifest, version: str, any_version: bool = False) -> None:
    """Note the version of code and configuration with which the sweep goes on.

    Raises BadInput if jobs were done by another one, unless `any_version`: then the manifest names both.
    """
    if manifest.version == version:
        return
    if not any(outcome.state == "done" for outcome in manifest.outcomes()):
        manifest.version = version
    elif any_version:
        manifest.version = "+".join(dict.fromkeys([*manifest.version.split("+"), version]))
    else:
        raise BadInput(
            f"{manifest.folder} holds results of another version of the code, the configuration or the packages ({manifest.version}, now "
            f"{version}); a table over both would compare unlike things. Give another hydra.sweep.dir, or type "
            f"python -m oio.sweep resume {manifest.folder} --any-version to keep what is done."
        )


def run_sweep(manifest: Manifest, jobs: Sequence[Job], engine: Engine, store: Store | None, places: tuple[str, ...]) -> list[Outcome]:
    """Run those of the jobs that are not done and are not in the store, and return how all of them stand.

    The manifest is written before the first begins.
    """
    _wait_for_others(manifest, jobs)
    before = {job: manifest.outcome(job) for job in jobs}
    todo = [job for job in jobs if before[job].state != "done"]
    _refuse_full_disk(manifest.folder, todo)
    _tell_cost(manifest, todo, list(before.values()))
    if todo:
        manifest.note_code()
    manifest.write()
    _tell(list(before.values()), manifest.folder)
    for job in todo:
        set_aside(manifest.folder / job.folder)
    todo, taken = _from_store(manifest, todo, store)
    _tell_taken(taken, store)
    ended = {}
    works = [Work(job, manifest.folder / job.folder, places) for job in todo]
    try:
        if todo:
            first_compile()  # or every worker would
        with CountProgress(len(todo)) as progress:
            for work, state, error in engine.run(works):
                ended[work.job] = state, error
                if state == "done" and store is not None:
                    store.keep(work.job, work.out)
                progress.ended(state)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(_stopped(manifest, jobs)) from None
    return [_outcome(manifest, job, ended.get(job)) for job in jobs]


def _from_store(manifest: Manifest, todo: Sequence[Job], store: Store | None) -> tuple[list[Job], int]:
    """Return the jobs that are left to run, and how many were taken from the store."""
    if store is None:
        return list(todo), 0
    left = [job for job in todo if not store.restore(job, manifest.folder / job.folder)]
    return left, len(todo) - len(left)


def _tell_taken(taken: int, store: Store | None) -> None:
    if store is not None and taken:
        sys.stderr.write(f"{taken} jobs are as in an earlier sweep, and are taken from {store.folder} (cache=off runs them again)\n")


def _outcome(manifest: Manifest, job: Job, ended: tuple[str, str | None] | None) -> Outcome:
    found = manifest.outcome(job)
    return Outcome(job, *ended, None) if found.state in ("missing", "killed") and ended is not None else found


def _wait_for_others(manifest: Manifest, jobs: Sequence[Job]) -> None:
    """Wait for jobs that a killed sweep has left running; they end by themselves within seconds."""
    told = False
    while any(manifest.outcome(job).state == "running" for job in jobs):
        if not told:
            sys.stderr.write("waiting for jobs that an earlier command has left running\n")
            told = True
        interrupt.check()
        time.sleep(0.2)


def _tell(before: Sequence[Outcome], folder: Path) -> None:
    """Say what is skipped and what is run again, and why; nothing where all is new."""
    states = Counter(outcome.state for outcome in before)
    if set(states) == {"missing"}:
        return
    again = [f"{states[state]} {why} and run again" for state, why in AGAIN.items() if states[state]]
    new = [f"{states['missing']} are new"] if states["missing"] else []
    done = f"{states['done']} are done already and are not run again" if states["done"] else ""
    sys.stderr.write(f"{len(before)} jobs in {folder}: {', '.join(part for part in (done, *again, *new) if part)}\n")


def _refuse_full_disk(folder: Path, todo: Sequence[Job]) -> None:
    free, needed = shutil.disk_usage(folder).free, _bytes(todo)
    if needed > free:
        raise BadInput(
            f"{len(todo)} jobs need about {needed / 1e6:.0f} MB, but {folder} has {free / 1e6:.0f} MB left. Give one on a larger disk, "
            "hydra.sweep.dir=..., type logging=summary, or sweep in parts."
        )


def _bytes(todo: Sequence[Job]) -> int:
    return sum(BYTES_PER_JOB["full" if _leaves_log(job.words) else "summary"] for job in todo)


def _leaves_log(words: Sequence[str]) -> bool:
    return "logging=summary" not in words and not any(word.startswith("trials=") and word != "trials=1" for word in words)


def _tell_cost(manifest: Manifest, todo: Sequence[Job], before: Sequence[Outcome]) -> None:
    """Say what the sweep will need: disk, and time if jobs of it have run before."""
    if len(todo) < 2:
        return
    took = [outcome.summary["wall_s"] for outcome in before if outcome.summary and outcome.summary.get("wall_s")]
    workers = manifest.launcher.get("processes") or manifest.launcher.get("workers") or 1
    lasting = f", about {in_words(statistics.median(took) * len(todo) / workers)}" if took else ""
    free = shutil.disk_usage(manifest.folder).free
    sys.stderr.write(
        f"{len(todo)} jobs to run{lasting}, about {_bytes(todo) / 1e6:.0f} MB at most of the {free / 1e9:.1f} GB that are left\n"
    )


def _stopped(manifest: Manifest, jobs: Sequence[Job]) -> str:
    done = sum(manifest.outcome(job).state == "done" for job in jobs)
    return f"stopped; {done} of {len(jobs)} jobs are done and kept. Go on with: python -m oio.sweep resume {manifest.folder}"
