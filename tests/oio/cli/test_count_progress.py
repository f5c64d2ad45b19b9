"""The progress of a sweep: how much time is left, also of jobs that take longer than half a minute."""

import pytest
from rich.cells import cell_len
from rich.console import Console

from oio.cli import count_progress as progress
from oio.cli import terminal
from oio.cli.count_progress import CountProgress


@pytest.fixture
def clock(monkeypatch):
    """The clock of the display: a list of one number [s]."""
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    return now


@pytest.mark.parametrize("width", [60, 80])
def test_the_time_left_is_that_of_the_mean_job_and_runs_down(clock, monkeypatch, width):
    shown = Console(force_terminal=True, width=width, color_system=None, record=True)
    monkeypatch.setattr(terminal, "may_move", lambda: True)
    monkeypatch.setattr(terminal, "console", lambda **_: shown)
    with CountProgress(10) as sweep:
        for after_s, state, told in (
            (100.0, "done", "about 15 min left"),
            (100.0, "failed", "about 13 min left"),
            (0.0, "done", "about 8 min left"),
        ):
            clock[0] += after_s
            sweep.ended(state)
            line = "".join(segment.text for segment in shown.render(sweep._bar.get_renderable()))
            assert told in line and cell_len(line.rstrip("\n")) <= width
        clock[0] += 400.0
        assert "about 67 s left" in "".join(segment.text for segment in shown.render(sweep._bar.get_renderable()))


def test_without_a_terminal_there_is_a_line_every_half_minute(clock, capsys):
    with CountProgress(4) as sweep:
        for after_s in (20.0, 20.0, 20.0, 20.0):
            clock[0] += after_s
            sweep.ended("done")
    assert capsys.readouterr().err == "2 of 4 jobs have ended, about 40 s left\n4 of 4 jobs have ended, about 0 s left\n"
