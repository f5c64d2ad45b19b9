"""Parser of a command's words whose mistakes are one paragraph, as everywhere in OIO: what was given, and what to type."""

import argparse
from typing import Any, NoReturn


class CommandParser(argparse.ArgumentParser):
    """argparse's, with exit code 2 and one line for a mistake, in place of the usage. `example`: words to type after the command."""

    def __init__(self, *, example: str = "--help", **options: Any) -> None:
        super().__init__(**options)
        self.example = example

    def error(self, message: str) -> NoReturn:
        """End the process with what is wrong and what to type. Words that may be left out are not asked for, though argparse names them."""
        optional = [str(action.metavar) for action in self._actions if action.nargs in ("*", "?") and not action.option_strings]
        for name in optional:
            message = message.replace(f", {name}", "") if message.startswith("the following arguments are required") else message
        self.exit(2, f"oio: {message}. Type e.g. {self.prog} {self.example}; --help says more.\n")
