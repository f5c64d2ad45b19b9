"""Errors of files and disks as one paragraph each."""

import errno
import shutil
from pathlib import Path

from oio.core.errors import BadInput, OioError

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)  # no room on the disk, in the quota, or in one file


def io_error(error: BaseException) -> OioError | None:
    """The error to show for one of the operating system; None if it names no file, and is not about room."""
    if not isinstance(error, OSError) or error.errno is None:
        return None
    if error.errno in FULL:
        return OioError(f"{_place(error)} cannot be written: {_reason(error)}. Make room, or choose another disk, and try again.")
    if error.filename is None:
        return None
    return BadInput(
        f"{error.filename} cannot be used: {_reason(error)}. Give a file or folder that this user may read and write, "
        f"e.g. hydra.run.dir=outputs/first for the folder of a run."
    )


def disk_full(error: OSError, out: Path) -> OioError:
    """The error of a run whose folder took no more: what is kept of it, and how to go on."""
    part = out / "run.mcap.part"
    kept = f"What was logged until then is kept. Type python -m oio.recover {part} to read it" if part.exists() else "Nothing is kept"
    return OioError(
        f"{out} takes no more: {_reason(error)} ({_free_mb(out):.0f} MB are free). {kept}. "
        f"Then make room and run again, or run on another disk: hydra.run.dir=FOLDER."
    )


def _free_mb(folder: Path) -> float:
    return shutil.disk_usage(folder).free / 1e6


def _place(error: OSError) -> str:
    return str(error.filename) if error.filename else "a file"


def _reason(error: OSError) -> str:
    return (error.strerror or "it failed").lower()
