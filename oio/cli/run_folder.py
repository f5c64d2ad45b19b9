"""The folder of a run and its status.json: claimed by one process, and readable by any other while the run goes on."""

import fcntl
import json
import os
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import IO, Any

from oio.core.errors import BadInput
from oio.results.summary import to_json

STOPPED = "stopped by the person or the system; run.mcap.part can be read, see python -m oio.recover"  # error of an interrupted run
STATUS, SUMMARY, LOCK = "status.json", "summary.json", "run.lock"
WRITTEN = ("config.yaml", "summary.json", "calibration.yaml", "run.mcap", "report.html")  # by a run, besides its status
LOG_IS_AT = "log_is_at.txt"  # in place of the log, where it stayed on the machine that ran the job


class RunFolder:
    """A folder claimed for one run, as a context: `run.lock` is held until the end, so that a killed run is known from one that goes on."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lock: IO[str] | None = None

    def __enter__(self) -> "RunFolder":
        """Claim the folder. Raises BadInput if another run has used it, or is about to."""
        refuse_used(self.path)
        self.path.mkdir(parents=True, exist_ok=True)
        lock = (self.path / LOCK).open("w", encoding="utf-8")
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            refuse_used(self.path)  # another run may have begun and ended since
        except OSError:
            lock.close()
            raise _used(self.path) from None
        except BadInput:
            lock.close()
            raise
        self._lock = lock
        write_status(self.path, "running", started=datetime.now(UTC).isoformat(timespec="milliseconds"))
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        assert self._lock is not None
        (self.path / LOCK).unlink(missing_ok=True)
        self._lock.close()

    def status(self, state: str, error: str | None = None, trace: str | None = None) -> None:
        """Write status.json."""
        write_status(self.path, state, error, trace)


def refuse_used(path: Path) -> None:
    """Raise BadInput if the folder holds a run already, or files of somebody else that the run would overwrite."""
    if (path / STATUS).exists():
        raise _used(path)
    if found := [name for name in WRITTEN if (path / name).exists()]:
        raise BadInput(
            f"{path} holds {', '.join(found)}, which a run would overwrite. Give another directory, e.g. hydra.run.dir={path}_2."
        )


def _used(path: Path) -> BadInput:
    return BadInput(f"{path} already holds a run (status.json). Give another directory, e.g. hydra.run.dir={path}_2.")


def write_status(path: Path, state: str, error: str | None = None, trace: str | None = None, started: str | None = None) -> None:
    """Write the status.json of a run's folder: `running`, `done`, `failed` or `interrupted`, what went wrong, and when it started
    (ISO 8601, UTC), which is kept if it is not given."""
    began = started or (read_json(path / STATUS) or {}).get("started")
    write_whole(path / STATUS, to_json({"state": state, "error": error, "traceback": trace, "started": began}))


def write_whole(path: Path, text: str) -> None:
    """Write a file so that a reader, or a process killed meanwhile, leaves the old text or the new one, never a part of it."""
    part = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        part.write_text(text, encoding="utf-8")
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def state_of(path: Path) -> tuple[str, str | None]:
    """Return the state of a run's folder and its error: that of status.json, `killed` if its process is gone, `missing` without one."""
    status = read_json(path / STATUS)
    if status is None:
        return ("killed" if (path / STATUS).exists() else "missing"), None
    state = str(status.get("state"))
    if state == "running" and not is_locked(path / LOCK):
        return "killed", None
    return state, status.get("error")


def read_json(path: Path) -> dict[str, Any] | None:
    """Return a JSON file, or None if there is none that can be read."""
    try:
        loaded = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return loaded if isinstance(loaded, dict) else None


def is_locked(path: Path) -> bool:
    """Whether a process holds the lock of this file."""
    try:
        with path.open("r", encoding="utf-8") as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except FileNotFoundError:
        return False
    except OSError:
        return True
    return False
