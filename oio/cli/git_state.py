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
    return _git("describe", "--always", "--dirty", "--abbrev=40").strip() or "no commit"


@functools.cache
def uncommitted() -> tuple[str, ...]:
    """Return the tracked files that have changed, and the new ones in folders that runs are made from. Once per process."""
    if not in_git():
        return ()
    entries = [entry for entry in _git("status", "--porcelain", "-z", "--no-renames").split("\0") if entry]
    return tuple(entry[3:] for entry in entries if not entry.startswith("??") or entry[3:].startswith(RUN_FROM))


def in_git() -> bool:
    """Whether the project lies in a git tree of its own."""
    return (ROOT / ".git").exists()


def _git(*words: str) -> str:
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False).stdout
