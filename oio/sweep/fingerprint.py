"""What results depend on besides a job's overrides and the files that it reads: code, configuration files, packages."""

import functools
import hashlib
import importlib.util
import platform
from collections.abc import Iterator, Sequence
from importlib import metadata
from pathlib import Path

from oio.cli.experiment import PACKAGES
from oio.cli.input_files import CODE
from oio.cli.plugins import FOLDER
from oio.core.folders import CONF, ROOT

SUFFIXES = (".py", ".xml", ".stl", ".yaml", ".csv", ".npz")
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
