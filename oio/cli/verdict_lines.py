"""The verdict in the terminal: a line per criterion, and below each one that does not pass what to do."""

from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.text import Text

COLOURS = {"PASS": "green", "WARN": "yellow", "FAIL": "red"}


def show_verdict(console: Console, document: Mapping[str, Any]) -> None:
    """Print the verdict of a summary; one that was written before there were criteria has only its reasons."""
    criteria = document.get("criteria") or []
    parts = ", ".join(f"{about} {word}" for about, word in (document.get("verdicts") or {}).items())
    words = f"{parts}, " if parts else ""
    console.print(f"verdict [bold {COLOURS[document['verdict']]}]{document['verdict']}[/]: {words}from what a bench can see")
    width = max((len(c["name"]) for c in criteria), default=0)
    for c in criteria:
        line = Text.assemble("  ", (c["word"], COLOURS[c["word"]]), f"  {c['name']:<{width}}  {c['found']} ({c['allowed']})")
        console.print(line)
        if c["action"]:
            console.print(Text(f"        {'':<{width}}-> {c['action']}"))
    for reason in [] if criteria else document["reasons"]:
        console.print(f"  - {reason}", markup=False)
