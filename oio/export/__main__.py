"""`python -m oio.export RUN --to FORMAT`: a run as files of other tools."""

import argparse
import os
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

from oio.core import startup
from oio.core.standard_output import ended

startup.handle_signals(__name__)

from rich.progress import Progress

from oio.cli import terminal
from oio.cli.exit_codes import run_command
from oio.core.arguments import CommandParser
from oio.core.errors import BadInput
from oio.core.records import WorldSample
from oio.export.kalibr import write_kalibr
from oio.export.robot_localization import write_robot_localization
from oio.export.run_record import RunRecord, find_log, read_run_record
from oio.export.table_files import write_csv, write_parquet
from oio.export.tum import write_tum
from oio.log import read_end

WRITERS: dict[str, Callable[[RunRecord, Path], list[Path]]] = {
    "csv": write_csv,
    "kalibr": write_kalibr,
    "parquet": write_parquet,
    "robot_localization": write_robot_localization,
    "tum": write_tum,
}
FORMATS = """\
formats:
  csv                 tracks.csv, readings.csv, joints.csv: for pandas, PlotJuggler
  parquet             the same as Parquet; needs pyarrow
  tum                 estimate.tum, dead_reckoning.tum, truth.tum: for evo
  kalibr              gas.yaml: the calibrated sensor as Kalibr writes an IMU
  robot_localization  ekf.yaml: parameters that fuse /estimate/odom in ROS 2

exit code: 0 written, 2 bad input, 130 stopped
"""


def main(arguments: list[str] | None = None) -> int:
    """Export one run and print the paths of the files; returns the exit code."""
    parser = CommandParser(
        example="outputs/first --to csv",
        prog="python -m oio.export",
        description=__doc__,
        epilog=FORMATS,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("run", type=Path, metavar="RUN", help="the folder of a run, or its run.mcap")
    parser.add_argument("--to", choices=sorted(WRITERS), required=True, metavar="FORMAT", help=", ".join(sorted(WRITERS)))
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="a new folder (default: FORMAT, beside the log)")
    given = parser.parse_args(arguments)
    return run_command(lambda: _export(find_log(given.run), given.to, given.out))


def _export(log: Path, to: str, out: Path | None) -> None:
    folder = out or log.parent / to
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise BadInput(f"{folder} is there already, and results are never overwritten. Type --out with the name of a new folder.")
    end_ns = read_end(log)
    run = read_run_record(log, lambda samples: _watched(samples, end_ns))
    unfinished = folder.with_name(f"{folder.name}.{os.getpid()}.part")  # a stop in the middle leaves no folder that looks complete
    try:
        unfinished.mkdir(parents=True)
        paths = WRITERS[to](run, unfinished)
        unfinished.rename(folder)
    except OSError as error:
        raise BadInput(f"{folder} cannot be written ({error.strerror}). Give --out with a folder that can be.") from None
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)
    sys.stdout.writelines(f"{folder / path.relative_to(unfinished)}\n" for path in paths)


def _watched(samples: Iterator[WorldSample], end_ns: int) -> Iterator[WorldSample]:
    """The samples of a log, with a progress bar in a terminal."""
    console = terminal.console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("reading", total=end_ns)
        for i, sample in enumerate(samples):
            if i % 1000 == 0:
                bar.update(task, completed=sample.t_ns)
            yield sample


if __name__ == "__main__":
    sys.exit(ended(main))
