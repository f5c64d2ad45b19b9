"""requirements.lock against what is installed: packages of the lock that are not installed are not compared."""

import functools
import re
from importlib import metadata
from pathlib import Path

from oio.core.folders import ROOT

LOCK = ROOT / "requirements.lock"
PIN = re.compile(r"^([A-Za-z0-9][\w.-]*)==([^\s;\\]+)", re.MULTILINE)


@functools.cache
def differing(lock: Path = LOCK) -> tuple[str, ...] | None:
    """Return `NAME INSTALLED, locked LOCKED` of every installed package of another version than the lock's; None without a lock.

    Read once per process: what is imported does not change, and a sweep has many jobs.
    """
    if not lock.is_file():
        return None
    found = ((name, _installed(name), versions) for name, versions in pinned(lock).items())
    return tuple(f"{name} {have}, locked {' or '.join(versions)}" for name, have, versions in found if have and have not in versions)


def pinned(lock: Path) -> dict[str, list[str]]:
    """Return the versions that a lock allows of each package: more than one where they depend on Python's version."""
    versions: dict[str, list[str]] = {}
    for name, version in PIN.findall(lock.read_text(encoding="utf-8")):
        versions.setdefault(name, []).append(version)
    return versions


def _installed(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None
