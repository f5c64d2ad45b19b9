"""`@compiled`: a numba-compiled function whose cache is thrown away when any source that it may have been compiled from changes.

numba's own cache looks at the file of a function alone. Compiled code holds the functions that it calls and the constants that it reads,
from whatever file: after a change there it would go on with the old ones, without a word. So the cache lies in a folder named by a hash
of all sources of the mathematics.
"""

import functools
import hashlib
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, TypeVar, cast

import llvmlite.binding
import numba

from oio.core.folders import ROOT

F = TypeVar("F", bound=Callable[..., Any])
SOURCES = ("oio/core", "oio/kinematics", "oio/motion", "oio/gas", "oio/inference", "oio/estimators", "oio/search", "hardware/air")
NUMBA: Any = numba.config  # its attributes are made at import
KEPT_S = 14 * 86_400.0  # an unused folder is kept so long


def compiled(function: F) -> F:
    """The function compiled at its first call (nopython mode), kept for later processes. The plain one is its `py_func`."""
    return _cached(function, "python")


def compiled_like_numpy(function: F) -> F:
    """The same, but division by zero gives infinity or NaN instead of an error, so that loops can be vectorised."""
    return _cached(function, "numpy")


def _cached(function: F, error_model: Literal["python", "numpy"]) -> F:
    before = NUMBA.CACHE_DIR
    NUMBA.CACHE_DIR = str(cache_folder())  # read when a function is decorated, never after
    try:
        made: Any = numba.njit(cache=True, error_model=error_model)(function)
    finally:
        NUMBA.CACHE_DIR = before
    return cast(F, made)


@functools.cache
def cache_folder() -> Path:
    """Where compiled code of these very sources lies: below NUMBA_CACHE_DIR, the project, or the user's cache folder."""
    folder = _base() / source_hash(ROOT)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        _forget_old(folder)
    except OSError:
        pass  # numba says what is wrong when it writes
    return folder


def complete_mark() -> Path:
    """The file, in the cache folder, that says that all is compiled for this processor, Python and compiler."""
    processor = llvmlite.binding.get_host_cpu_name()
    return cache_folder() / "-".join(("complete", processor, str(sys.implementation.cache_tag), numba.__version__))


def source_hash(root: Path) -> str:
    """Of every Python file in SOURCES below `root`, with its name."""
    digest = hashlib.sha256()
    for path in sorted(path for source in SOURCES for path in (root / source).rglob("*.py")):
        digest.update(f"{path.relative_to(root).as_posix()}\0{path.stat().st_size}\0".encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _base() -> Path:
    if NUMBA.CACHE_DIR:
        return Path(NUMBA.CACHE_DIR)
    if os.access(ROOT, os.W_OK):
        return ROOT / ".numba_cache"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "oio"


def _forget_old(folder: Path) -> None:
    """Remove what was compiled from sources that nobody has used for long."""
    for other in folder.parent.iterdir():
        if len(other.name) == len(folder.name) and other.is_dir() and time.time() - other.stat().st_mtime > KEPT_S:
            for path in sorted(other.rglob("*"), reverse=True):
                path.rmdir() if path.is_dir() else path.unlink()
            other.rmdir()
