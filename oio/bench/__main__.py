"""`python -m oio.bench COMMAND KEY=VALUE ...`: known errors print one paragraph; exit code 2 for bad input, else 1."""

import signal
import sys
from collections.abc import Callable

from oio.core import startup
from oio.core.standard_output import ended

startup.handle_signals(__name__)

from oio.bench import accuracy, drift, filters, pair_bound, searches, stereo, worlds
from oio.bench.arguments import SOURCE
from oio.cli import terminal
from oio.cli.exit_codes import run_command
from oio.core.errors import BadInput

COMMANDS: dict[str, Callable[[list[str]], None]] = {
    "accuracy": accuracy.run,
    "worlds": worlds.run,
    "searches": searches.run,
    "stereo": stereo.run,
    "pair_bound": pair_bound.run,
    "drift": drift.run,
    "filters": filters.run,
}
HEADER = """[bold]Benchmarks[/bold] of olfactory inertial odometry, over many seeds:

  python -m oio.bench accuracy                              all sensors, airs and rungs
  python -m oio.bench accuracy sensor=ec air=still,draft dof=5 seeds=0:100 jobs=4
  python -m oio.bench accuracy ekf=ekf,paper stage.navigate.max_moves=40
  python -m oio.bench worlds sensor=ndir seeds=7000:7010    worlds that changed after calibration
  python -m oio.bench searches                              search strategies on the same calibrated benches
  python -m oio.bench stereo seeds=7100:7120                two elements at one place or two, in turn or together
  python -m oio.bench pair_bound                            what the model says that they can tell: bounds, in a minute
  python -m oio.bench drift                                 the nose after 1, 5 and 30 minutes, against dead reckoning
  python -m oio.bench filters                               microseconds per step, against filterpy
"""


def main(arguments: list[str] | None = None) -> int:
    """Run one benchmark; returns the exit code."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
    return run_command(lambda: _run(sys.argv[1:] if arguments is None else arguments), "stopped; what was done is saved.")


def _run(arguments: list[str]) -> None:
    if not arguments or {"--help", "-h"} & set(arguments):
        return _help()
    if arguments[0] not in COMMANDS:
        given = f"'{arguments[0]}' was given"
        raise BadInput(f"{given}, but a benchmark is one of {', '.join(COMMANDS)}. Type e.g. python -m oio.bench accuracy.")
    COMMANDS[arguments[0]](arguments[1:])


def _help() -> None:
    console = terminal.console(soft_wrap=True, highlight=False)
    console.print(HEADER)
    console.print(SOURCE.read_text(encoding="utf-8").rstrip(), markup=False)


if __name__ == "__main__":
    sys.exit(ended(main))
