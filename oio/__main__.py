"""The command `oio`, or `python -m oio`: every other command by its name, a run by its overrides alone, and tab completion."""

import difflib
import runpy
import sys

from oio import __version__
from oio.cli.command_table import COMMANDS
from oio.core import startup
from oio.core.standard_output import ended

startup.handle_signals("__main__")  # whichever command follows

USAGE = """usage: oio COMMAND ...            `oio COMMAND --help` says more of each
       oio KEY=VALUE ...          a run: the same as `oio run KEY=VALUE ...`
       oio completion SHELL       tab completion for bash, zsh or fish
       oio --version
"""


def main() -> int:
    """Run the command that is named; returns the exit code, unless the command ends the process itself."""
    return ended(_main)


def _main() -> int:
    words = sys.argv[1:]
    name = words[0] if words else "--help"
    if name in COMMANDS:
        return _run_module(COMMANDS[name][0], words[1:])
    if name in ("--help", "-h"):
        sys.stdout.write(_usage())
        return 0
    if name == "--version":
        sys.stdout.write(f"oio {__version__}\n")
        return 0
    if name in ("completion", "--complete"):
        return _complete(name, words[1:])
    if name.startswith(("-", "+", "~")) or "=" in name:
        return _run_module("oio.run", words)
    near = difflib.get_close_matches(name, COMMANDS, 1)
    sys.stderr.write(f"oio: '{name}' is no command. Type oio {near[0] if near else '--help'}.\n")
    return 2


def _run_module(module: str, words: list[str]) -> int:
    sys.argv = [module, *words]
    runpy.run_module(module, run_name="__main__", alter_sys=True)
    return 0


def _complete(name: str, words: list[str]) -> int:
    from oio.cli.completion import INSTALL, SHELLS, completions
    from oio.core.folders import CONF

    if name == "--complete" and len(words) == 1:
        sys.stdout.writelines(f"{word}\n" for word in completions(words[0], CONF))
        return 0
    if len(words) == 1 and words[0] in SHELLS:
        sys.stdout.write(SHELLS[words[0]])
        return 0
    lines = "\n".join(f"  {line}" for line in INSTALL.values())
    sys.stderr.write(
        f"oio: completion of {' '.join(words) or 'no shell'} was asked for, but it can be {', '.join(SHELLS)}. Put:\n{lines}\n"
    )
    return 2


def _usage() -> str:
    return USAGE + "\n" + "\n".join(f"  {name:<10} {text}" for name, (_, text) in COMMANDS.items()) + "\n"


if __name__ == "__main__":
    sys.exit(main())
