"""The live panel: what a person sees while a run goes on, in a terminal that is not there."""

import io
import sys
import time

import numpy as np
import pytest
from rich.cells import cell_len
from rich.console import Console

from oio.cli import progress_lines
from oio.cli.live_panel import LivePanel
from oio.cli.progress_lines import ProgressLines
from oio.cli.run_display import run_display
from oio.cli.run_state import RunState
from oio.cli.signal_history import STEP_NS, STEPS, SignalHistory
from oio.core.records import SECOND_NS, Event, GasReading
from oio.log import BeliefScene, MemoryLog, Progress, StageMark


def tell(watcher, for_s=70):
    """A little of a run: warm-up, then a search that has found something."""
    watcher(StageMark(0, "warm_up", "begin"))
    for t in range(10 * for_s):
        watcher(GasReading(t * SECOND_NS // 10, t % 2, 5.0 + (t % 2) * t / 100, 0.1))
    watcher(Progress(SECOND_NS, "warm_up", "slope to vanish", "+1.00 +- 0.10 ppm/min, settled in about 12 s"))
    watcher(StageMark(2 * SECOND_NS, "warm_up", "end"))
    watcher(StageMark(2 * SECOND_NS, "navigate", "begin"))
    watcher(Event(3 * SECOND_NS, "move", "1.0 s to [0.1]"))
    scene = np.zeros((0, 3)), np.zeros(0), [(np.array([0.3, -0.1, 0.2]), np.diag([4e-6, 0.0, 0.0]))], "source"
    watcher(BeliefScene(4 * SECOND_NS, *scene))


@pytest.mark.parametrize("width", [60, 80, 200])
def test_the_panel_says_stage_signal_settling_source_and_moves(width):
    told = io.StringIO()
    with LivePanel(Console(file=told, force_terminal=True, width=width, color_system=None)) as panel:
        tell(panel)
    last = told.getvalue().split("\x1b[2K")[-1]
    for words in ("✓ warm_up", "2.0 s", "+1.00 +- 0.10 ppm/min", "› navigate", "element 0", "element 1", "▁", "█", "1 moves"):
        assert words in last, last
    assert "source at 0.300, -0.100, 0.200 m +- 2 mm" in last
    assert max(map(cell_len, last.splitlines())) <= width


@pytest.mark.parametrize("width", [50, 60, 80, 200])
def test_what_a_stage_waits_for_is_told_whole_while_it_goes_on(width):
    told = io.StringIO()
    with LivePanel(Console(file=told, force_terminal=True, width=width, color_system=None)) as panel:
        panel(StageMark(0, "warm_up", "begin"))
        panel(Progress(SECOND_NS, "warm_up", "slope to vanish", "+1.00 +- 0.10 ppm/min, settled in about 12 s"))
    lines = told.getvalue().split("\x1b[2K")[-1].splitlines()
    assert (
        " ".join(" ".join(lines).split()).startswith("› warm_up 1.0 s slope to vanish, +1.00 +- 0.10 ppm/min, settled in about 12 s")
        and max(map(cell_len, lines)) <= width
    )


def test_a_belief_is_of_the_source_that_was_open_and_lasts_until_the_end():
    state = RunState()
    tell(state.take, 1)
    state.take(StageMark(5 * SECOND_NS, "evaluate", "begin"))
    assert state.source is not None and state.moves == 1
    state.take(Event(5 * SECOND_NS, "present", "source"))
    assert state.source is None


def test_without_a_terminal_it_is_off(capsys):
    with run_display() as panel:
        assert panel is None
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(("name", "value"), [("NO_COLOR", "1"), ("TERM", "dumb")])
def test_where_nothing_may_move_a_stage_is_a_line(name, value, capsys, monkeypatch):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv(name, value)
    with run_display() as lines:
        tell(lines)
        lines(StageMark(5 * SECOND_NS, "navigate", "failed", "the arm is lost"))
        with lines.paused():
            lines(StageMark(5 * SECOND_NS, "warm_up", "end"))
    told = capsys.readouterr().err
    assert told == "warm_up: +1.00 +- 0.10 ppm/min, settled in about 12 s (2.0 s)\nnavigate: failed (5.0 s)\n"
    with run_display(quiet=True) as lines:
        assert lines is None


def test_a_long_stage_has_a_line_now_and_then(capsys, monkeypatch):
    now = [0.0]
    monkeypatch.setattr(progress_lines.time, "monotonic", lambda: now[0])
    lines = ProgressLines()
    lines(StageMark(0, "warm_up", "begin"))
    for t in range(1, 71):
        now[0] = float(t)
        lines(Progress(t * SECOND_NS, "warm_up", "slope to vanish", f"{t}"))
    assert capsys.readouterr().err == "warm_up: slope to vanish, 31 (31.0 s)\nwarm_up: slope to vanish, 62 (62.0 s)\n"


def test_it_is_drawn_a_few_times_a_second_however_much_is_told():
    told = io.StringIO()
    with LivePanel(Console(file=told, force_terminal=True, width=80)) as panel:
        log, began = MemoryLog(), time.monotonic()
        log.watchers.append(panel)
        with log.stage("warm_up", lambda: 0):
            while time.monotonic() - began < 0.6:
                log.reading(GasReading(0, 0, 1.0, 0.1))
    assert 2 <= told.getvalue().count("warm_up") <= 6


def test_a_history_holds_a_minute_in_means():
    history = SignalHistory()
    for i in range(100 * STEPS):
        history.add(GasReading(i * STEP_NS // 10, 0, float(i // 10), 0.1))
    history.add(GasReading(0, 0, np.nan, 0.1))
    assert history.means_ppm == [float(i) for i in range(9 * STEPS, 10 * STEPS)]
    line = history.sparkline()
    assert len(line) == STEPS and list(line) == sorted(line) and (line[0], line[-1]) == ("▁", "█")


def test_a_flat_signal_is_a_flat_line():
    history = SignalHistory()
    assert history.sparkline() == ""
    history.add(GasReading(0, 0, 3.0, 0.1))
    assert history.sparkline() == "▁"
