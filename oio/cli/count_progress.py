"""Progress of jobs or trials on stderr: a bar with the time left in a terminal, else a line now and then."""

import sys
import time
from types import TracebackType

from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn, TimeElapsedColumn
from rich.table import Column
from rich.text import Text

from oio.cli import terminal

LINE_S = 30.0  # between two lines where there is no terminal


class TimeLeft(ProgressColumn):
    """The time that is left, by the mean over all that have ended. (Rich's own looks back for 30 s, and jobs may take longer.)"""

    def __init__(self) -> None:
        super().__init__(Column(no_wrap=True))  # the bar gives way
        self._until_s: float | None = None

    def ended(self, after_s: float, ended: int, jobs: int) -> None:
        """Note that so many of the jobs have ended, the last of them just now, so long after the first began."""
        self._until_s = time.monotonic() + after_s / ended * (jobs - ended)

    @property
    def left_s(self) -> float:
        """Seconds until the last job ends; 0 if that should have been, or if none has ended."""
        return 0.0 if self._until_s is None else max(0.0, self._until_s - time.monotonic())

    def render(self, task: Task) -> Text:
        """Say it, if there is anything to say."""
        return Text(f"about {in_words(self.left_s)} left" if self.left_s else "", style="progress.remaining")


class CountProgress:
    """Counts `what` (jobs, trials) as they end; `quiet`: silently."""

    def __init__(self, jobs: int, what: str = "jobs", quiet: bool = False) -> None:
        self._left = TimeLeft()
        columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), self._left
        self._terminal, self._what, self._quiet = terminal.may_move() and not quiet, what, quiet
        self._bar = Progress(*columns, console=terminal.console(stderr=True), disable=not self._terminal)
        self._task = self._bar.add_task(what, total=jobs)
        self._jobs, self._ended, self._failed = jobs, 0, 0
        self._began = self._told = time.monotonic()  # of the display alone

    def __enter__(self) -> "CountProgress":
        self._bar.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._bar.stop()

    def ended(self, state: str) -> None:
        """Count one that ended in this state."""
        self._ended += 1
        self._failed += state != "done"
        failed = f", {self._failed} failed" if self._failed else ""
        now = time.monotonic()
        self._left.ended(now - self._began, self._ended, self._jobs)
        self._bar.update(self._task, completed=self._ended, description=f"{self._what}{failed}")
        if not self._terminal and not self._quiet and now - self._told > LINE_S:
            self._told = now
            sys.stderr.write(f"{self._ended} of {self._jobs} {self._what} have ended{failed}, about {in_words(self._left.left_s)} left\n")


def in_words(seconds: float) -> str:
    """Return a duration as a person says it."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
