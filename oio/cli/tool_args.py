"""Command line parsing of the small tools (hardware.ports, home, joints): KEY=VALUE words, as everywhere in OIO."""

import sys
from collections.abc import Callable, Mapping, Sequence

from oio.cli.exit_codes import run_command
from oio.core import interrupt
from oio.core.errors import BadInput


def key_values(arguments: Sequence[str], keys: Mapping[str, str], command: str) -> tuple[dict[str, str], list[str]]:
    """Return all keys with their values, given or default, and the other words. Raises BadInput for unknown keys."""
    values, plain = dict(keys), list[str]()
    for argument in arguments:
        key, equals, value = argument.partition("=")
        if not equals:
            plain.append(argument)
        elif key not in keys:
            raise BadInput(f"{argument} was given, but `{command}` knows {', '.join(keys)}. Type e.g. {next(iter(keys))}=VALUE, or --help.")
        else:
            values[key] = value
    return values, plain


def whole_number(key: str, value: str, low: int, high: int) -> int:
    """Parse a whole number from low to high. Raises BadInput."""
    if not value.isdecimal() or not low <= int(value) <= high:
        raise BadInput(f"{key}={value} was given, but {key} is a whole number from {low} to {high}. Type {key}={low}.")
    return int(value)


def run_tool(main: Callable[[list[str]], None], help_text: str) -> int:
    """Run `main` with the command line words, or print the help; return the exit code."""
    interrupt.listen()
    if {"--help", "-h"} & set(sys.argv[1:]):
        print(help_text)  # noqa: T201
        return 0
    return run_command(lambda: main(sys.argv[1:]))
