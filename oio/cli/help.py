"""`--help`: every choice of conf/ with the sentence that heads its YAML, and every top-level key with its comment."""

import re
from collections.abc import Sequence
from pathlib import Path

from rich.markup import escape
from rich.table import Table

from oio.cli import terminal
from oio.core.folders import CONF

HEADER = """[bold]Olfactory inertial odometry[/bold]: calibrate a gas sensor on a robot arm, then find a smell with it.

  python -m oio.run sensor=ec dof=5                     one run in simulation
  python -m oio.run -m sensor=ec,ndir seed=0,1,2 hydra/launcher=joblib    a sweep, in parallel
  python -m oio.sweep resume FOLDER                     a sweep that was stopped goes on; also status, table, compare, worst
  python -m oio.run backend=replay backend.log=RUN/run.mcap               the same estimator on a log
  python -m oio.run calibration=RUN/calibration.yaml stage=\\[navigate,evaluate]    begin with a calibration that was kept
  python -m oio.figures RUN                             a picture of a run
  python -m oio.run sensor=ec dof=5 --cfg job           every number that a run would use
  python -m oio.run --config-dir FOLDER ekf=NAME        with choices of your own, in FOLDER/ekf/NAME.yaml
"""
GROUPS = (
    "sensor",
    "profile",
    "air",
    "world",
    "backend",
    "recording",
    "arm",
    "ekf",
    "belief_map",
    "bout",
    "search",
    "stage",
    "protocol",
    "verdict",
    "view",
    "experiment",
)
NOTES = {"stage": "[...]  in this order; leave some out", "experiment": "  typed with a plus: +experiment=..."}
PLAIN = ("dof", "assembly", "seed", "calibration", "source.position", "beacon.position")
PLAIN_TEXT = {
    "dof": "rung of the arm's ladder, how many joints move: of the SO-101 1, 2, 3 or 5",
    "assembly": "gum or paper: how Q and R are made of the uncertainties",
    "seed": "of everything random: truth, turbulence and noise are independent streams of it",
    "calibration": "RUN/calibration.yaml of an earlier run to begin with, and stage=\\[navigate,evaluate]",
    "source.position": "\\[x,y,z] m in the arm's base frame: the unknown source; null draws it from the seed",
    "beacon.position": "\\[x,y,z] m in the arm's base frame: the known source of the calibration",
}


ASK = ("--help", "-h")


def asks_for_help(arguments: Sequence[str]) -> bool:
    """Whether a command line asks for help."""
    return bool(set(ASK) & set(arguments))


def show_help_for(arguments: Sequence[str]) -> None:
    """Print the help for a command line, with the choices of the user's own folder (--config-dir) if one is given.

    What follows `--help` is asked for: keys and choices. Raises BadInput for one that does not exist.
    """
    own, others = list[Path](), list[str]()
    rest = iter(arguments)
    for word in rest:
        found = re.fullmatch(r"(?:--config-dir|-cd)(?:=(.*))?", word)
        if found and (folder := found[1] or next(rest, None)):
            own.append(Path(folder))
        elif not found:
            others.append(word)
    asked = others[min(others.index(word) for word in ASK if word in others) + 1 :]
    if keys := [word for word in asked if not word.startswith("-")]:
        from oio.cli.help_keys import show_keys

        show_keys(keys, (CONF, *own))
    else:
        show_help(CONF, *own)


def show_help(*folders: Path) -> None:
    """Print the choices of all configuration folders: the project's, and one of the user's own."""
    console = terminal.console(soft_wrap=True)
    console.print(HEADER)
    for group in GROUPS:
        table = Table.grid(padding=(0, 2))
        for name, text in (choice for folder in folders for choice in choices(folder, group)):
            table.add_row(f"  {name}", escape(text))
        console.print(f"[bold]{group}=[/bold]" + NOTES.get(group, ""))
        console.print(table)
    for key in PLAIN:
        console.print(f"[bold]{key}=[/bold]  {PLAIN_TEXT[key]}")
    console.print("\nAny other number: KEY.OF.THE.YAML=VALUE, e.g. stage.navigate.max_moves=40. Defaults stand in conf/config.yaml.")
    console.print("What a key means, and which values are allowed: --help KEY, e.g. --help stop, --help sensor=ndir.")


def choices(conf: Path, group: str) -> list[tuple[str, str]]:
    """Names of a group with the sentence that heads each YAML."""
    return [(path.stem, _first_comment(path)) for path in sorted((conf / group).glob("*.yaml"))]


def _first_comment(path: Path) -> str:
    """The first sentence of the comment that heads a YAML."""
    text = ""
    for line in path.read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            break
        if line.startswith("# @package"):  # Hydra wants it on the first line
            continue
        text = f"{text} {line.lstrip('# ')}".strip()
    return re.split(r"(?<=[a-z)\d`])\.\s", f"{text} ", maxsplit=1)[0].rstrip(". ") + "."
