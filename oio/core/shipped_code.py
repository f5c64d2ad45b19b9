"""Compiled code that a wheel brings along, so that the first run after an install need not compile.

`make wheel` compiles for a kind of processor that nearly all of today's are (PROCESSOR) and packs what numba kept; a new install copies it
to its cache. numba keeps code in a folder named by that of its source and finds it by an index, whose keys hold the signature, the
processor and a hash of the function: both are made to fit the place and the processor. Code of other sources, another Python, numba or
system is left alone, and compiled as without a wheel.
"""

import io
import os
import pickle
import platform
import shutil
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import llvmlite.binding
import numba
from numba.core.caching import UserProvidedCacheLocator
from numba.core.registry import cpu_target

from oio.core.compiled import NUMBA, SOURCES, cache_folder, complete_mark
from oio.core.folders import ROOT

SHIPPED = ROOT / "oio" / "_compiled"
MACHINE = "x86_64"
PROCESSOR = "x86-64-v3"  # Intel since Haswell (2013), AMD since Excavator (2015)
NEEDS = ("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")
BUILD = {"NUMBA_CPU_NAME": PROCESSOR, "NUMBA_CPU_FEATURES": ""}  # environment of the process that compiles what is shipped


def name_of(sources: str) -> str:
    """Name of the folder of code shipped for sources of this hash, this Python, numba and system."""
    return "-".join((sources, str(sys.implementation.cache_tag), numba.__version__, sys.platform, platform.machine()))


def pack(cache: Path, into: Path) -> int:
    """Copy what numba keeps in `cache` to `into`, by the folders of its sources; returns the number of files."""
    files = [(path, into / folder) for folder in _source_folders() for path in (cache / _kept_in(ROOT / folder)).glob("*.nb?")]
    for path, folder in files:
        folder.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, folder)
    return len(files)


def use_shipped() -> bool:
    """Copy the wheel's code to the cache unless that was done; returns whether all that is compiled is there. A cache that cannot be
    written is none."""
    shipped, done = SHIPPED / name_of(cache_folder().name), complete_mark()
    if not done.exists() and shipped.is_dir() and runs_here():
        with suppress(OSError):
            unpack(shipped, cache_folder())
            done.touch()
    return done.exists()


def unpack(shipped: Path, cache: Path) -> None:
    """Copy packed code to `cache`, but for functions of which it has some already."""
    for index in sorted(shipped.rglob("*.nbi")):
        kept = cache / _kept_in(ROOT / index.parent.relative_to(shipped))
        kept.mkdir(parents=True, exist_ok=True)
        if (kept / index.name).exists():
            continue
        for code in index.parent.glob(f"{index.stem}.*.nbc"):
            shutil.copy(code, kept)
        beside = kept / f"{index.name}.{os.getpid()}"
        beside.write_bytes(for_this_processor(index.read_bytes()))
        beside.replace(kept / index.name)  # whole, or not at all


def runs_here() -> bool:
    """Whether this processor has all that shipped code uses, and no other was asked for."""
    if platform.machine() != MACHINE or NUMBA.DISABLE_JIT or NUMBA.CPU_NAME is not None or NUMBA.CPU_FEATURES is not None:
        return False
    has = llvmlite.binding.get_host_cpu_features()
    return all(has.get(feature, False) for feature in NEEDS)


def for_this_processor(index: bytes) -> bytes:
    """An index of numba's cache, with this processor in its keys."""
    version, stamp, overloads = read_index(index)
    here: Any = cpu_target.target_context.codegen().magic_tuple()
    kept = {(signature, here, hashes): name for (signature, _, hashes), name in overloads.items()}
    return pickle.dumps(version, protocol=-1) + pickle.dumps((stamp, kept), protocol=-1)


def read_index(index: bytes) -> tuple[str, Any, dict[tuple[Any, Any, Any], str]]:
    """numba's version, the stamp of the source, and the file of code for each signature, processor and hashes of the function."""
    stream = io.BytesIO(index)
    version, (stamp, overloads) = pickle.load(stream), pickle.load(stream)  # noqa: S301  (part of the program, as its source is)
    return version, stamp, overloads


def _source_folders() -> Sequence[Path]:
    return sorted({path.parent.relative_to(ROOT) for source in SOURCES for path in (ROOT / source).rglob("*.py")})


def _kept_in(folder: Path) -> str:
    """Name of numba's folder for the code of files in `folder`."""
    locator: Any = UserProvidedCacheLocator
    return str(locator.get_suitable_cache_subpath(str(folder / "any.py")))
