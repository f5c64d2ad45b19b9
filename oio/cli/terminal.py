"""The terminal: how wide it is, whether it wants escape sequences, and whether anything may move on it."""

import os
import sys
from typing import Any

from rich.console import Console

UNLIMITED = 400  # columns of a file or a pipe: nothing is gained by a narrow table there


class _Console(Console):
    """A console that leaves it to the command what to do where nobody reads."""

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError


def console(**settings: Any) -> Console:
    """Return a console of standard output (`stderr=True`: of standard error) as wide as its terminal, COLUMNS, or what a file allows.

    With NO_COLOR (no-color.org) it prints no escape sequence at all. `settings` are those of `rich.console.Console`.
    """
    plain = {"color_system": None, "force_terminal": False} if no_color() else {}
    made = _Console(**{**settings, **plain})
    if not made.file.isatty() and not ({"width", "force_terminal"} & set(settings)) and not os.environ.get("COLUMNS", "").isdigit():
        made.width = UNLIMITED
    return made


def no_color() -> bool:
    """Whether the user wants no escape sequences: NO_COLOR is set and not empty."""
    return bool(os.environ.get("NO_COLOR"))


def may_move() -> bool:
    """Whether standard error is a terminal on which the cursor may be moved."""
    return sys.stderr.isatty() and not no_color() and os.environ.get("TERM") != "dumb"
