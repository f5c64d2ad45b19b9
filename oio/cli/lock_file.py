"""requirements.lock against what is installed: packages of the lock that are not installed are not compared."""

import functools
import re
import sys
from collections.abc import Iterable
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
    allowed = pinned(lock)
    installed = _installed(allowed).items()
    return tuple(f"{name} {have}, locked {' or '.join(allowed[name])}" for name, have in installed if have not in allowed[name])


def pinned(lock: Path) -> dict[str, list[str]]:
    """Return the versions that a lock allows of each package: more than one where they depend on Python's version."""
    versions: dict[str, list[str]] = {}
    for name, version in PIN.findall(lock.read_text(encoding="utf-8")):
        versions.setdefault(name, []).append(version)
    return versions


def _installed(names: Iterable[str]) -> dict[str, str]:
    """Versions of the packages that are installed, by the names of their folders: importlib.metadata parses a file for each (70 ms)."""
    folders = [path for place in sys.path for path in sorted(Path(place or ".").glob("*.dist-info"))]
    found: dict[str, str] = {}
    for folder in folders:
        name, _, version = folder.name.removesuffix(".dist-info").partition("-")
        found.setdefault(_normal(name), version)  # of two the first on the path is imported
    return {name: found[_normal(name)] for name in names if _normal(name) in found}


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "_", name).lower()
