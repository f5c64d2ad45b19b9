"""Progress of a run on a terminal where nothing may move (NO_COLOR, TERM=dumb): a line per stage, and one now and then in a long one."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType

from oio.cli.run_state import RunState
from oio.core.records import seconds
from oio.log import Entry, StageMark

LINE_S = 30.0  # of the wall clock, between two lines of one stage


class ProgressLines:
    """A watcher for `RunLog.watchers`, and a context."""

    def __init__(self) -> None:
        self._state, self._asking = RunState(), False
        self._told_s = time.monotonic()  # clock of the display alone

    def __enter__(self) -> "ProgressLines":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Nothing is left to write."""

    @contextmanager
    def paused(self) -> Iterator[None]:
        """A context in which nothing is written: a person is asked."""
        self._asking = True
        try:
            yield
        finally:
            self._asking = False

    def __call__(self, entry: Entry) -> None:
        """Take up an entry of the log; write a line if a stage has ended, or if it is time."""
        self._state.take(entry)
        if isinstance(entry, StageMark) and entry.state != "begin":
            stage = self._state.stages[entry.stage]
            self._write(f"{entry.stage}: {'failed' if entry.state == 'failed' else stage.figure or 'done'} ({seconds(entry.t_ns):.1f} s)")
        elif time.monotonic() - self._told_s > LINE_S and self._state.stages:
            name, stage = list(self._state.stages.items())[-1]
            self._write(f"{name}: {stage.told or 'goes on'} ({seconds(stage.t_ns):.1f} s)")

    def _write(self, line: str) -> None:
        if not self._asking:
            self._told_s = time.monotonic()
            sys.stderr.write(f"{line}\n")
