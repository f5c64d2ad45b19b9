"""The commit of the project's tree, and what in it is not committed."""

import functools
import subprocess

from oio.core.folders import ROOT

RUN_FROM = ("oio/", "pipelines/", "hardware/", "hydra_plugins/", "conf/")  # new files elsewhere (answers, notes) change no run


@functools.cache
def commit() -> str:
    """Return the commit, with `-dirty` where tracked files have changed. Once per process: the code of a process is that of its start."""
    if not in_git():
        return "no git"
    dirty = "-dirty" if any(not entry.startswith("??") for entry in _entries()) else ""
    name = _git("describe", "--always", "--abbrev=40").strip()
    return f"{name}{dirty}" if name else "no commit"


def uncommitted() -> tuple[str, ...]:
    """Return the tracked files that have changed, and the new ones in folders that runs are made from."""
    if not in_git():
        return ()
    return tuple(entry[3:] for entry in _entries() if not entry.startswith("??") or entry[3:].startswith(RUN_FROM))


@functools.cache
def _entries() -> tuple[str, ...]:
    """What git's status says of each file that is not as committed, such as ` M oio/run.py`. Once per process."""
    return tuple(entry for entry in _git("status", "--porcelain", "-z", "--no-renames").split("\0") if entry)


def in_git() -> bool:
    """Whether the project lies in a git tree of its own."""
    return (ROOT / ".git").exists()


def _git(*words: str) -> str:
    line = ["git", "--no-optional-locks", *words]  # a run that is killed leaves no lock in the repository
    return subprocess.run(line, cwd=ROOT, capture_output=True, text=True, check=False).stdout
