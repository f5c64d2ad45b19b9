"""How fast a sweep goes, from the times at which its jobs ended: for a display, no result depends on it."""

import time
from pathlib import Path

from oio.cli.run_folder import SUMMARY
from oio.sweep.manifest import Outcome


def seconds_left(folder: Path, outcomes: list[Outcome]) -> tuple[float, float] | None:
    """Return jobs per minute and the seconds left, or None while too few have ended."""
    ended = sorted(_ended_at(folder / outcome.job.folder) for outcome in outcomes if outcome.state == "done")
    left = sum(outcome.state in ("missing", "running") for outcome in outcomes)
    if len(ended) < 2 or ended[-1] == ended[0]:
        return None
    recent = ended[-20:]
    per_second = (len(recent) - 1) / max(max(time.time(), recent[-1]) - recent[0], 1e-3)
    return 60 * per_second, left / per_second


def _ended_at(path: Path) -> float:
    return (path / SUMMARY).stat().st_mtime
