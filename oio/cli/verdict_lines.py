"""The verdict in the terminal: a line per criterion, and below each one that does not pass what to do."""

from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.text import Text

from oio.cli.hanging_text import print_hanging

COLOURS = {"PASS": "green", "WARN": "yellow", "FAIL": "red"}


def show_verdict(console: Console, document: Mapping[str, Any]) -> None:
    """Print the verdict of a summary; one that was written before there were criteria has only its reasons."""
    criteria = document.get("criteria") or []
    parts = ", ".join(f"{about} {word}" for about, word in (document.get("verdicts") or {}).items())
    head = Text.assemble("verdict ", (document["verdict"], f"bold {COLOURS[document['verdict']]}"), ": ")
    print_hanging(console, head, f"{f'{parts}, ' if parts else ''}from what a bench can see")
    width = max((len(c["name"]) for c in criteria), default=0)
    for c in criteria:
        head = Text.assemble("  ", (c["word"], COLOURS[c["word"]]), f"  {c['name']:<{width}}  ")
        print_hanging(console, head, f"{c['found']} ({c['allowed']})")
        if c["action"]:
            print_hanging(console, f"        {'':<{width}}-> ", c["action"])
    for reason in [] if criteria else document["reasons"]:
        print_hanging(console, "  - ", reason)
