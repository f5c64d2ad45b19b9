"""What a person sees of a run while it goes on: a live panel, lines where nothing may move, nothing where nobody looks."""

import sys

from oio.cli import terminal
from oio.cli.live_panel import LivePanel
from oio.cli.progress_lines import ProgressLines


def run_display(quiet: bool = False) -> LivePanel | ProgressLines:
    """Return the display on standard error; `quiet`, or where that is no terminal, a panel that is off."""
    if quiet or not sys.stderr.isatty():
        return LivePanel(None)
    return LivePanel(terminal.console(stderr=True)) if terminal.may_move() else ProgressLines()
