"""What results depend on besides a job's overrides: the code, the configuration files, the packages, and the files that a run reads."""

import functools
import hashlib
import importlib.util
import os
import platform
from collections.abc import Iterator, Sequence
from importlib import metadata
from pathlib import Path

from omegaconf import DictConfig, ListConfig

from oio.cli.experiment import PACKAGES
from oio.cli.plugins import FOLDER
from oio.core.folders import CONF, ROOT

CODE = ("oio", "pipelines", "hardware")
SUFFIXES = (".py", ".xml", ".stl", ".yaml", ".csv", ".npz")
FILE_KEYS = {"path", "file", "log", "calibration", "answers", "homing", "mjcf"}  # keys whose value names a file, also a plain word
NO_RESULT = (
    "oio/api",
    "oio/bench",
    "oio/compare",
    "oio/doctor",
    "oio/export",
    "oio/figures",
    "oio/gym",
    "oio/identify",
    "oio/inspect",
    "oio/localise",
    "oio/report",
    "oio/reproduce",
    "oio/sweep",
    "oio/testing",
    "oio/view",
    "hardware/doctor",
    "hardware/firmware",
)  # rooms that no number of a run depends on


@functools.cache
def version_of_everything(folders: tuple[Path, ...] = ()) -> str:
    """Return a hash of code, configuration (the user's own `folders` too), Python and packages, as 16 hexadecimal digits."""
    told = hashlib.sha256(platform.python_version().encode())
    for package in PACKAGES:
        told.update(f"{package} {_installed(package)}\n".encode())
    for root in (*(ROOT / name for name in CODE), CONF, *folders):
        for path in _sources(root):
            told.update(f"{path.relative_to(root)}\n".encode())
            told.update(path.read_bytes())
    return told.hexdigest()[:16]


def folders_of(places: Sequence[str]) -> tuple[Path, ...]:
    """Return the folders of places on Hydra's search path: of `pkg://NAME` those of the package."""
    return tuple(folder for place in places for folder in _folders(place))


def _folders(place: str) -> list[Path]:
    if place.startswith(FOLDER):
        return [Path(place.removeprefix(FOLDER))]
    package, _, below = place.removeprefix("pkg://").partition("/")
    try:
        spec = importlib.util.find_spec(package)
    except ModuleNotFoundError:
        return []
    return [Path(folder, below) for folder in spec.submodule_search_locations or ()] if spec else []


def _sources(root: Path) -> Iterator[Path]:
    excluded = {ROOT / name for name in NO_RESULT}
    for path in sorted(root.rglob("*")):
        if path.suffix in SUFFIXES and not excluded.intersection(path.parents) and path.is_file():
            yield path


def _installed(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "-"


def input_files(cfg: DictConfig) -> dict[str, str]:
    """Return the files that a configuration names, with the hash of their bytes: logs, recordings and air, as they are or below OIO_DATA,
    and the code of other packages that it builds from (`_target_`)."""
    found = {str(file): hash_of(file) for package in _packages(cfg) for file in _code(package)}
    data = Path(os.environ.get("OIO_DATA", "data"))
    for key, text in sorted(set(_entries(cfg))):
        is_file = key in FILE_KEYS or "." in text or "/" in text  # elsewhere a plain word is a choice
        named = [Path(text).expanduser()] if is_file and text else []
        for path in (*named, data / text) if 0 < len(text) < 1024 else ():
            found |= {str(file): hash_of(file) for file in _files(path) if not file.resolve().is_relative_to(ROOT / "hardware")}
    return found


def _packages(cfg: DictConfig) -> set[str]:
    """The packages, other than the project's, whose classes a configuration names."""
    targets = {text.split(".")[0] for key, text in _entries(cfg) if key == "_target_"}
    return {name for name in targets if name not in CODE}


def _code(package: str) -> list[Path]:
    spec = importlib.util.find_spec(package)
    if spec is None or spec.origin is None:
        return []
    path = Path(spec.origin)
    return sorted(path.parent.rglob("*.py")) if path.name == "__init__.py" else [path]


def _files(path: Path) -> list[Path]:
    if path.is_file():
        return [path]
    return sorted(file for file in path.rglob("*") if file.is_file()) if path.is_dir() and path.name not in ("", "..") else []


def hash_of(path: Path) -> str:
    """Return the hash of a file's bytes, read once per size and time of change; `-` if it cannot be read."""
    try:
        about = path.stat()
        return _hash(path, about.st_size, about.st_mtime_ns)
    except OSError:
        return "-"


@functools.lru_cache(maxsize=4096)
def _hash(path: Path, size: int, mtime_ns: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:16]


def _entries(node: object, key: str = "") -> Iterator[tuple[str, str]]:
    """Yield the texts of a configuration, each with its key."""
    if isinstance(node, str):
        yield key, node
    elif isinstance(node, DictConfig | dict):
        for name, value in node.items():
            yield from _entries(value, str(name))
    elif isinstance(node, ListConfig | Sequence):
        for value in node:
            yield from _entries(value, key)
