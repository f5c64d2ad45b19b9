"""Progress of a sweep on stderr: a bar with the time left in a terminal, else a line now and then."""

import sys
import time
from types import TracebackType

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from oio.cli import terminal

LINE_S = 30.0  # between two lines where there is no terminal


class SweepProgress:
    """Counts jobs as they end."""

    def __init__(self, jobs: int) -> None:
        columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn()
        self._terminal = terminal.may_move()
        self._bar = Progress(*columns, console=terminal.console(stderr=True), disable=not self._terminal)
        self._task = self._bar.add_task("jobs", total=jobs)
        self._jobs, self._ended, self._failed = jobs, 0, 0
        self._began = self._told = time.monotonic()  # of the display alone

    def __enter__(self) -> "SweepProgress":
        self._bar.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._bar.stop()

    def ended(self, state: str) -> None:
        """Count a job that ended in this state."""
        self._ended += 1
        self._failed += state != "done"
        failed = f", {self._failed} failed" if self._failed else ""
        self._bar.update(self._task, completed=self._ended, description=f"jobs{failed}")
        now = time.monotonic()
        if not self._terminal and now - self._told > LINE_S:
            self._told = now
            left = (now - self._began) / self._ended * (self._jobs - self._ended)
            sys.stderr.write(f"{self._ended} of {self._jobs} jobs have ended{failed}, about {in_words(left)} left\n")


def in_words(seconds: float) -> str:
    """Return a duration as a person says it."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
