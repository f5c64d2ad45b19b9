"""`python -m oio.reproduce RUN`: make a run again from its own log, in a new folder, and say whether its estimates are equal to the bit.

A simulated run is run again; of a bench, a recording or a replay the log is replayed.
"""

import argparse
import itertools
import sys
from pathlib import Path

from oio.core import startup
from oio.core.standard_output import ended

startup.handle_signals(__name__)

from rich.console import Console

from oio.cli import terminal
from oio.cli.execute import execute
from oio.cli.exit_codes import run_command
from oio.cli.plugins import FOLDER, absolute, plugin_packages
from oio.cli.run import check_packages
from oio.core import interrupt
from oio.core.arguments import CommandParser
from oio.core.errors import BadInput
from oio.reproduce.comparison import compare
from oio.reproduce.configuration import experiment_again
from oio.reproduce.original import LOG, Original, differing, original

DIFFERENT = 3
SHOWN = 10  # keys or versions that differ
CODES = "exit code: 0 equal to the bit, 3 different, 1 the run could not be made again, 2 bad input"


def main(arguments: list[str] | None = None) -> int:
    """Make one run again and compare; returns the exit code."""
    parser = CommandParser(example="outputs/first", prog="python -m oio.reproduce", description=__doc__, epilog=CODES)
    parser.add_argument("run", type=Path, metavar="RUN", help="the folder of a run, or its run.mcap; only read")
    parser.add_argument("words", nargs="*", metavar="KEY=VALUE", help="what its log cannot give, such as paths: arm.homing=homing.json")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="of the new run (default: RUN_again)")
    parser.add_argument("--config-dir", type=Path, metavar="FOLDER", help="the choices of your own that the run was made with")
    given = parser.parse_intermixed_args(arguments)
    equal: list[bool] = []
    code = run_command(lambda: equal.append(_reproduce(given)))
    return code or (0 if equal[0] else DIFFERENT)


def _reproduce(given: argparse.Namespace) -> bool:
    check_packages()
    made = original(given.run)
    if given.out is not None and given.out.exists():
        raise BadInput(f"--out {given.out} was given, but it is there already. Give a new folder, or leave --out out.")
    own = () if given.config_dir is None else (absolute(f"{FOLDER}{given.config_dir}"),)
    experiment, keys = experiment_again(made, given.words, (*own, *plugin_packages()))
    out = given.out or _unused(made)
    with interrupt.listening():
        execute(experiment, out)
    console = terminal.console(soft_wrap=True, highlight=False)
    console.print(f"{'run again' if made.simulated else 'replayed'}: {out}", markup=False)
    _name(console, "configuration", keys)
    _name(console, "version", differing(made.versions, original(out).versions))
    return _say(console, made, out / LOG)


def _name(console: Console, what: str, texts: list[str]) -> None:
    for text in texts[:SHOWN]:
        console.print(f"{what} differs: {text}", markup=False)
    if len(texts) > SHOWN:
        console.print(f"{what} differs in {len(texts) - SHOWN} more", markup=False)


def _say(console: Console, made: Original, now: Path) -> bool:
    found = compare(made.log, now, replayed=not made.simulated)
    for one in found:
        console.print(f"{one.what}: {one.text}", markup=False)
    equal = all(one.equal is not False for one in found)
    console.print("[bold green]EQUAL[/]" if equal else "[bold red]DIFFERENT[/]")
    return equal


def _unused(made: Original) -> Path:
    folder = made.folder.resolve()
    names = itertools.chain([f"{folder.name}_again"], (f"{folder.name}_again{n}" for n in itertools.count(2)))
    return next(path for path in (folder.with_name(name) for name in names) if not path.exists())


if __name__ == "__main__":
    sys.exit(ended(main))
