"""The commands of `python -m oio.sweep`: status, resume, table, compare, worst."""

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from oio.cli.exit_codes import run_command
from oio.cli.plugins import FOLDER, plugin_packages
from oio.core import interrupt
from oio.core.arguments import CommandParser
from oio.core.errors import BadInput, OioError
from oio.sweep.displays import comparison, status, table, worst_jobs
from oio.sweep.fingerprint import folders_of, version_of_everything
from oio.sweep.group_table import HEADS
from oio.sweep.job_table import show_sweep
from oio.sweep.launch import engine_of
from oio.sweep.manifest import Manifest, locked
from oio.sweep.store import Store
from oio.sweep.sweep import adopt_version, run_sweep

EXAMPLES = """\
  python -m oio.sweep status outputs/sweep                  how far it is; also from another terminal while it runs
  python -m oio.sweep resume outputs/sweep                  what is missing, failed, was stopped or killed, and nothing else
  python -m oio.sweep table outputs/sweep --by sensor,air --out table.csv
  python -m oio.sweep compare outputs/sweep_a outputs/sweep_b    the same seeds in pairs
  python -m oio.sweep worst outputs/sweep                   the jobs to look at first
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code."""
    return run_command(lambda: _run(sys.argv[1:] if arguments is None else list(arguments)))


def _run(arguments: list[str]) -> None:
    given = _parser().parse_args(arguments)
    given.run(given)


def _parser() -> CommandParser:
    parser = CommandParser(
        prog="python -m oio.sweep", example="status outputs/sweep", epilog=EXAMPLES,
        description="Sweeps that `python -m oio.run -m` has begun.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def command(name: str, run: Callable[[argparse.Namespace], None], about: str, *folders: str) -> CommandParser:
        made = commands.add_parser(name, help=about.replace("%", "%%"), description=about)
        made.example = " ".join("outputs/sweep" for _ in folders)
        for folder in folders:
            made.add_argument(folder, type=Path, metavar=folder.upper(), help="the folder of a sweep")
        made.set_defaults(run=run)
        return made

    command("status", status, "how many jobs are done, running, failed, and the time left", "dir")
    resume = command("resume", _resume, "run what is missing, failed, was stopped or killed, and nothing else", "dir")
    resume.add_argument("--jobs", type=int, metavar="N", help="worker processes (default: as the sweep was begun)")
    resume.add_argument(
        "--config-dir", type=Path, action="append", default=[], metavar="FOLDER",
        help="a folder with your own configuration, if the sweep was begun with one; once for each",
    )  # fmt: skip
    resume.add_argument("--address", metavar="TCP", help="of the Dask scheduler, if the sweep was begun with one")
    resume.add_argument("--any-version", action="store_true", help="keep what another version of the code or configuration has done")
    grouped = command("table", table, "a row per group, with 95 % bootstrap intervals", "dir")
    grouped.epilog = "columns:\n" + "\n".join(f"  {head:<14} {meaning}" for head, meaning in HEADS.items())
    grouped.formatter_class = argparse.RawDescriptionHelpFormatter
    grouped.add_argument("--by", metavar="KEY,KEY", help="groups (default: sensor,dof,air and what differs); job: a row per job")
    grouped.add_argument("--out", type=Path, metavar="FILE", help="also a file: .csv, .parquet, .md or .tex")
    command(
        "compare", comparison, "two sweeps in pairs of the same case and seed, and what differs in their configuration", "dir_a", "dir_b"
    )
    looked = command("worst", worst_jobs, "the jobs to look at first: failed, wrong though declared, far off", "dir")
    looked.add_argument("--count", type=int, default=10, metavar="N", help="at most so many (default 10)")
    return parser


def _resume(given: argparse.Namespace) -> None:
    if given.jobs is not None and given.jobs < 1:
        raise BadInput(f"--jobs {given.jobs} was given, but it is 1 or more. Type e.g. --jobs 2.")
    Manifest.read(given.dir)  # refuses a folder of something else before a lock is made in it
    with locked(given.dir):
        manifest = Manifest.read(given.dir)
        places = _places(manifest, given.config_dir)
        adopt_version(manifest, version_of_everything(folders_of(places)), given.any_version)
        manifest.launcher = _launcher(manifest, given.jobs, given.address)
        with interrupt.listening():
            outcomes = run_sweep(manifest, manifest.jobs, engine_of(manifest.launcher), Store.of(manifest, places), places)
    show_sweep(outcomes, str(given.dir))
    failed = sum(outcome.state != "done" for outcome in outcomes)
    if failed:
        raise OioError(f"{failed} jobs of the sweep failed; their status.json says why.")


def _places(manifest: Manifest, folders: Sequence[Path]) -> tuple[str, ...]:
    """Folders on the search path: the user names them again, because a file that came from elsewhere may name any."""
    given = [f"{FOLDER}{folder.resolve()}" for folder in folders]
    wanted = [place for place in manifest.places if place.startswith(FOLDER)]
    if wanted != given:
        needed = "".join(f" --config-dir {place.removeprefix(FOLDER)}" for place in wanted)
        told = f"{manifest.folder} was made with{needed or 'out --config-dir'}"
        raise BadInput(f"{told}. Type python -m oio.sweep resume {manifest.folder}{needed}")
    return (*given, *plugin_packages())


def _launcher(manifest: Manifest, jobs: int | None, address: str | None) -> dict[str, Any]:
    """Name and settings of the launcher. A scheduler elsewhere is named again too: what it answers is run as code."""
    if jobs is not None:
        return {"name": "joblib", "processes": jobs}
    known = manifest.launcher.get("address")
    if known != address:
        needed = f" --address {known}" if known else ""
        told = f"{manifest.folder} was made with{needed or 'out --address'}"
        raise BadInput(f"{told}. Type python -m oio.sweep resume {manifest.folder}{needed}, or --jobs 2 for processes of this machine.")
    return manifest.launcher
