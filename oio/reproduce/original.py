"""The run to be made again: its folder and log, and what they say of it."""

import json
from dataclasses import dataclass
from pathlib import Path

from oio.core.errors import BadInput
from oio.log import read_metadata

LOG = "run.mcap"


@dataclass(frozen=True, slots=True)
class Original:
    """A finished log, the metadata in it, and its folder, where calibration.yaml and summary.json may lie."""

    log: Path
    about: dict[str, str]

    @property
    def folder(self) -> Path:
        """Folder of the log."""
        return self.log.parent

    @property
    def simulated(self) -> bool:
        """Whether its world was a simulation, which can be run again; other worlds are replayed from the log."""
        return self.about.get("world", "None") != "None"

    @property
    def versions(self) -> dict[str, str]:
        """Versions that it was made with, and the commit."""
        return {**json.loads(self.about.get("versions", "{}")), "git": self.about.get("git", "unknown")}


def original(run: Path) -> Original:
    """Find the log of a run by its folder or its path. Raises BadInput for a run without a finished log."""
    log = run / LOG if run.is_dir() else run
    if not log.is_file():
        unfinished = ", but its log is not finished: python -m oio.recover makes one" if log.with_name(f"{log.name}.part").exists() else ""
        raise BadInput(
            f"{run} was given{unfinished or ', but it holds no run.mcap'}. Type python -m oio.reproduce RUN, a folder of a run with a log "
            f"(logging=full), or the log itself."
        )
    return Original(log, read_metadata(log))


def differing(before: dict[str, str], now: dict[str, str]) -> list[str]:
    """Return `NAME BEFORE -> NOW` of every version that differs, the commit among them."""
    return [f"{name} {before.get(name, '-')} -> {now.get(name, '-')}" for name in {**before, **now} if before.get(name) != now.get(name)]
