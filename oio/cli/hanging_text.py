"""Text that is wrapped at words to the width of the terminal, its further lines below where its first began."""

from rich.console import Console
from rich.text import Text

LEAST = 20  # columns of text, however deep it hangs


def print_hanging(console: Console, head: Text | str, text: str) -> None:
    """Print a head, and beside it a text of as many lines as it takes."""
    before = Text(head) if isinstance(head, str) else head
    lines = Text(text).wrap(console, max(LEAST, console.width - len(before)))
    for number, line in enumerate(lines):
        line.rstrip()
        console.print(Text.assemble(before if number == 0 else " " * len(before), line), soft_wrap=True)
