"""Live panel of a run in a terminal: stages, the signal of every element, the believed source, moves. Drawn a few times a second."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType

from rich.console import Console, Group
from rich.live import Live
from rich.table import Column, Table
from rich.text import Text

from oio.cli.run_state import RunState, StageState
from oio.core.records import seconds
from oio.log import Entry

PERIOD_S = 0.25  # of the wall clock, between two drawings at least,
DRAWING = 0.03  # and so much longer that drawing takes no more than this share of the time
SIGNS = {"begin": ("›", "bold"), "end": ("✓", "green"), "failed": ("✗", "red")}


class LivePanel:
    """A watcher for `RunLog.watchers`, and a context. Without a console it is off."""

    def __init__(self, console: Console | None) -> None:
        self._state, self._due_s, self._began_s = RunState(), 0.0, time.monotonic()  # clocks of the display alone
        self._live = None if console is None else Live(console=console, auto_refresh=False, transient=False)

    def __enter__(self) -> "LivePanel | None":
        """Begin to draw; returns None where there is nothing to draw on."""
        if self._live is None:
            return None
        self._live.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self._live is not None:
            self._live.update(self._panel(), refresh=True)
            self._live.stop()

    @contextmanager
    def paused(self) -> Iterator[None]:
        """A context in which nothing is drawn: a person is asked."""
        if self._live is not None:
            self._live.stop()
        try:
            yield
        finally:
            if self._live is not None:
                self._live.start()

    def __call__(self, entry: Entry) -> None:
        """Take up an entry of the log; draw if it is time."""
        assert self._live is not None, "a panel that is off watches nothing"
        self._state.take(entry)
        now = time.monotonic()
        if now >= self._due_s:
            self._live.update(self._panel(), refresh=True)
            drawn = time.monotonic()
            self._due_s = drawn + max(PERIOD_S, (drawn - now) / DRAWING)

    def _panel(self) -> Group:
        stages = Table.grid("", Column(justify="right"), "", padding=(0, 2, 0, 0))
        for name, stage in self._state.stages.items():
            stages.add_row(*_stage(name, stage))
        return Group(stages, *self._signals(), *self._source())

    def _signals(self) -> list[Text]:
        """A sparkline per element: a minute of the world, two seconds a block."""
        told = sorted(self._state.signals.items())
        return [_line(f"  element {element}  {signal.sparkline():>30}  {signal.latest_ppm:.2f} ppm") for element, signal in told]

    def _source(self) -> list[Text]:
        if not self._state.stages:
            return []
        lines = [_line(f"  {self._state.moves} moves, {time.monotonic() - self._began_s:.0f} s elapsed")]
        if self._state.source is not None:
            place, sd_m = self._state.source
            lines.insert(0, _line(f"  source at {', '.join(f'{value:.3f}' for value in place)} m +- {1e3 * sd_m:.0f} mm"))
        return lines


def _stage(name: str, stage: StageState) -> tuple[Text, ...]:
    """Sign and name, time, and what it has found, or, while it goes on, what it waits for in as many lines as that takes."""
    sign, style = SIGNS[stage.state]
    told = Text(stage.told) if stage.state == "begin" else _line(stage.figure)
    return _line(f"{sign} {name}", style), _line(f"{seconds(stage.t_ns):.1f} s"), told


def _line(text: str, style: str = "") -> Text:
    return Text(text, style, no_wrap=True, overflow="ellipsis")
