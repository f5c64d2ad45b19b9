"""Files that a run reads besides its configuration: logs, recordings, air, calibrations; and the code of other packages."""

import functools
import hashlib
import importlib.util
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from omegaconf import DictConfig, ListConfig

from oio.core.folders import ROOT

CODE = ("oio", "pipelines", "hardware")
FILE_KEYS = {"path", "file", "log", "calibration", "answers", "homing", "mjcf"}  # keys whose value names a file, also a plain word
DIGITS = 16  # of a hash, where it tells files apart


def input_files(cfg: DictConfig) -> dict[str, str]:
    """Return the files that a configuration names, with the hash of their bytes: logs, recordings and air, as they are or below OIO_DATA,
    and the code of other packages that it builds from (`_target_`)."""
    code = {file for package in _packages(cfg) for file in _code(package)}
    return {str(file): hash_of(file) for file in (*sorted(code), *(file for _, _, files in _named(cfg) for file in files))}


def inputs_in_words(config: Mapping[str, object]) -> dict[str, str]:
    """Return what a configuration names of files, as it was typed, with size and SHA-256: `sha256sum` tells the same of one file."""
    return {typed: _in_words(path, files) for typed, path, files in _named(config)}


def hash_of(path: Path) -> str:
    """Return the hash of a file's bytes, read once per size and time of change; `-` if it cannot be read."""
    return _sha256(path)[:DIGITS]


def _in_words(path: Path, files: Sequence[Path]) -> str:
    if path in files:
        return f"{files[0].stat().st_size} bytes, SHA-256 {_sha256(files[0])}"
    listed = "".join(f"{_sha256(file)}  {file.relative_to(path)}\n" for file in files)
    return f"{len(files)} files, SHA-256 of their list {hashlib.sha256(listed.encode()).hexdigest()}"


def _named(cfg: object) -> Iterator[tuple[str, Path, list[Path]]]:
    """Yield every text that names a file or a folder outside of the project's own models, its path, and the files."""
    data = Path(os.environ.get("OIO_DATA", "data"))
    for key, text in sorted(set(_entries(cfg))):
        is_file = key in FILE_KEYS or "." in text or "/" in text  # elsewhere a plain word is a choice
        named = [Path(text).expanduser()] if is_file and text else []
        for path in (*named, data / text) if 0 < len(text) < 1024 else ():
            if files := [file for file in _files(path) if not file.resolve().is_relative_to(ROOT / "hardware")]:
                yield text, path, files


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


def _sha256(path: Path) -> str:
    try:
        about = path.stat()
        return _digest(path, about.st_size, about.st_mtime_ns)
    except OSError:
        return "-"


@functools.lru_cache(maxsize=4096)
def _digest(path: Path, size: int, mtime_ns: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


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
