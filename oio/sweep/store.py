"""Results kept from one sweep to the next, under the hash of all that they depend on: the same work is never done twice.

An entry holds the files of a finished run and their hashes. It is found by version of code and configuration, overrides, and the place of
the recordings; it counts only while every file that the run read is as it was, and its own files are whole.
"""

import hashlib
import json
import os
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from oio.cli.input_files import hash_of
from oio.cli.run_folder import LOG_IS_AT, STATUS, SUMMARY, read_json, write_whole
from oio.sweep.manifest import INPUTS, Job, Manifest

INDEX = "entry.json"
REPEATABLE = ("mujoco", "replay", "recording")  # backends whose runs are equal to the bit; on hardware nothing happens twice
DEFAULT = Path("outputs") / ".results"


@dataclass(frozen=True)
class Store:
    """A folder of entries. `version` is that of code and configuration."""

    folder: Path
    version: str
    places: tuple[str, ...] = ()

    @classmethod
    def of(cls, manifest: Manifest, places: tuple[str, ...]) -> "Store | None":
        """The user's store (OIO_CACHE, or `outputs/.results`) for a sweep; None if it was begun with cache=off, or mixes versions."""
        if manifest.cache == "off" or "+" in manifest.version:
            return None
        return cls(Path(os.environ.get("OIO_CACHE") or DEFAULT), manifest.version, places)

    def restore(self, job: Job, out: Path) -> bool:
        """Put the files of the same run into a job's folder, status.json last; False if there are none, or if they no longer count."""
        entry = self._entry(job)
        index = read_json(entry / INDEX)
        if index is None or not _counts(entry, index):
            return False
        try:
            out.mkdir(parents=True, exist_ok=True)
            for name in sorted(index["files"], key=lambda name: name == STATUS):
                _place(entry / name, out / name)
        except OSError:  # a full disk, or a store whose files cannot be read
            shutil.rmtree(out, ignore_errors=True)
            return False
        return True

    def keep(self, job: Job, out: Path) -> None:
        """Keep the files of a job that is done, in place of an entry that no longer counts.

        What cannot be kept (a full disk), or is not whole (a log that stayed on another machine), is left out.
        """
        summary = read_json(out / SUMMARY)
        entry = self._entry(job)
        if summary is None or summary.get("backend") not in REPEATABLE or (out / LOG_IS_AT).exists():
            return
        index = read_json(entry / INDEX)
        if index is not None and _counts(entry, index):
            return
        made = entry.with_name(f"{entry.name}.{os.getpid()}.part")
        try:
            made.mkdir(parents=True)
            files = sorted(path for path in out.iterdir() if path.is_file())
            for path in files:
                _place(path, made / path.name)
            index = {"job": list(job.key), "inputs": read_json(out / INPUTS) or {}, "files": {path.name: hash_of(path) for path in files}}
            write_whole(made / INDEX, json.dumps(index, indent=1) + "\n")
            if entry.exists():
                shutil.rmtree(entry)
            made.rename(entry)
        except OSError:
            shutil.rmtree(made, ignore_errors=True)

    def _entry(self, job: Job) -> Path:
        about = [self.version, *self.places, os.environ.get("OIO_DATA", ""), *job.key]
        return self.folder / hashlib.sha256("\n".join(about).encode()).hexdigest()[:24]


def _counts(entry: Path, index: dict[str, Any]) -> bool:
    """Whether every file that the run read is as it was, and the files of the entry are whole."""
    read = all(hash_of(Path(name)) == told for name, told in index["inputs"].items())
    return read and all(hash_of(entry / name) == told for name, told in index["files"].items())


def _place(source: Path, target: Path) -> None:
    """Copy a file; large ones are linked where that can be done, so that they lie on the disk once."""
    if source.stat().st_size > 65536:
        try:
            os.link(source, target)
            return
        except OSError:
            pass  # another file system
    shutil.copyfile(source, target)
