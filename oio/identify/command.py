"""The command line of `python -m oio.identify`."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from oio.cli import terminal
from oio.cli.exit_codes import run_command
from oio.core.arguments import CommandParser
from oio.core.errors import BadInput
from oio.identify.display import save, show
from oio.identify.element_quantities import element_rows
from oio.identify.logged import read_logged_run
from oio.identify.record import Record
from oio.identify.record_quantities import delay_rows, noise_rows, step_rows, twin_rows
from oio.identify.recorded import bout_rule, read_recording
from oio.identify.row import Row, identified

MANY = 4  # elements beyond which only their noise is shown
EXAMPLES = """\
  python -m oio.identify outputs/first                         a run: its stages in clean air, warm_up and baseline
  python -m oio.identify outputs/first --stage all             the whole log
  python -m oio.identify recording=sgp30_64h recording.unit=ticks --out drift.csv
  python -m oio.identify recording=orebro3dsen                 27 elements: their noise; one of them: --element C_102
  python -m oio.identify recording=scd30_windows --step 48000:50400 --gas 49303   a step: tau, t90
  python -m oio.identify recording=airscout32 bout=cusum       false alarms of another bout rule

exit code: 0 done (what cannot be identified is said), 2 bad input, 130 stopped
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Identify one record; returns the exit code."""
    return run_command(lambda: _run(sys.argv[1:] if arguments is None else list(arguments)))


def _run(arguments: list[str]) -> None:
    given = _parser().parse_args(arguments)
    words = [word for word in given.what if "=" in word]
    paths = [Path(word) for word in given.what if "=" not in word]
    if len(paths) > 1 or (paths and any(word.startswith("recording=") for word in words)):
        raise BadInput(f"{' '.join(given.what)} was given, but one run or one recording is identified at a time. Type one of them.")
    with terminal.console(stderr=True).status("reading"):
        record = read_logged_run(paths[0], given.stage) if paths else read_recording(words)
        record = record.only(given.element) if given.element else record
    with terminal.console(stderr=True).status("identifying"):
        rows = _rows(record, words, given)
    if given.out is not None:
        save(record, rows, given.out)
    show(record, rows)


def _rows(record: Record, words: list[str], given: argparse.Namespace) -> list[Row]:
    rows = identified("all", "noise", noise_rows, record)
    if len(record.elements) > MANY:
        return [row for row in rows if row.quantity == "noise"]
    rule = bout_rule(words)
    for element in record.elements:
        rows += element_rows(record, element, rule, 60.0 * given.forecast_min)
        if given.step is not None:
            rows += identified(element.name, "step", step_rows, element, *_interval(given.step), given.gas, record.unit)
    rows += identified("all", "gain", twin_rows, record) if len(record.elements) > 1 else []
    if record.approaches is not None:
        rows += identified(record.elements[0].name, "delay", delay_rows, record.elements[0].name, record.approaches, given.seed)
    order = ["all", *(element.name for element in record.elements)]
    return sorted(rows, key=lambda row: order.index(row.element))


def _interval(text: str) -> tuple[float, float]:
    try:
        begin, end = (float(part) for part in text.split(":"))
    except ValueError:
        begin = end = 0.0
    if not begin < end:
        raise BadInput(f"--step {text} was given, but it is BEGIN:END in seconds of the record. Type e.g. --step 0:300.")
    return begin, end


def _parser() -> CommandParser:
    parser = CommandParser(
        prog="python -m oio.identify", example="recording=sgp30_64h", epilog=EXAMPLES,
        description="Noise, drift, lags and twins of a sensor, from its readings.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("what", nargs="+", metavar="WHAT", help="the folder or log of a run; or recording=NAME and other KEY=VALUE")
    parser.add_argument("--stage", action="append", default=[], metavar="NAME", help="of a run, once for each; all: the whole log")
    parser.add_argument("--element", action="append", default=[], metavar="NAME", help="one element of several, once for each")
    parser.add_argument("--step", metavar="BEGIN:END", help="seconds of the record between which the gas rose or fell once")
    parser.add_argument("--gas", type=float, metavar="S", help="second of the record at which the gas changed: gives the dead time")
    parser.add_argument("--forecast-min", type=float, default=60.0, metavar="MIN", help="length of a record for which K is forecast")
    parser.add_argument("--seed", type=int, default=0, help="of the bootstrap of the delay (default 0)")
    parser.add_argument("--out", type=Path, metavar="FILE", help="also a file with all digits: .csv or .json")
    return parser
