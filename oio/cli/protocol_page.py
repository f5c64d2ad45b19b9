"""`python -m oio.protocol NAME`: print a protocol as a page for the lab book, with the stages and keys of the run that it goes with.

Words after the name are those of the run, e.g. sensor=ndir 'stage=[warm_up,baseline]'. Without --html or --markdown it is Markdown on
standard output.
"""

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from omegaconf import DictConfig, OmegaConf

from oio.cli.build import procedure_of
from oio.cli.compose import compose
from oio.cli.exit_codes import run_command
from oio.cli.help import choices
from oio.cli.plugins import FOLDER, absolute, plugin_packages
from oio.core.arguments import CommandParser
from oio.core.errors import BadInput
from oio.core.folders import CONF
from oio.procedure.html_page import html
from oio.procedure.markdown import markdown
from oio.procedure.page import Page, StageAbout, page
from oio.procedure.steps import in_mm

CHOSEN = ("sensor", "profile", "arm", "backend", "ekf", "search")
PLAIN = ("dof", "seed", "assembly")
CODES = "exit code: 0 printed, 2 bad input"


def main(arguments: list[str] | None = None) -> int:
    """Print or write one page; returns the exit code."""
    parser = CommandParser(example="emulated", prog="python -m oio.protocol", description=__doc__, epilog=CODES)
    parser.add_argument("name", metavar="NAME", help="of a protocol: conf/protocol/NAME.yaml")
    parser.add_argument("words", nargs="*", metavar="KEY=VALUE", help="of the run")
    parser.add_argument("--config-dir", type=Path, metavar="FOLDER", help="with choices of your own, FOLDER/protocol/NAME.yaml")
    written = parser.add_mutually_exclusive_group()
    written.add_argument("--html", type=Path, metavar="FILE", help="one HTML file that needs no other")
    written.add_argument("--markdown", type=Path, metavar="FILE", help="a Markdown file")
    given = parser.parse_intermixed_args(arguments)
    own = () if given.config_dir is None else (absolute(f"{FOLDER}{given.config_dir}"),)
    return run_command(lambda: _write(described([f"protocol={given.name}", *given.words], own), given.html, given.markdown))


def _write(content: Page, as_html: Path | None, as_markdown: Path | None) -> None:
    out = as_html or as_markdown
    text = html(content) if as_html else markdown(content)
    if out is None:
        sys.stdout.write(text)
        return
    try:
        out.write_text(text, encoding="utf-8")
    except OSError as error:
        raise BadInput(f"{out} cannot be written ({error.strerror}). Give another file.") from None
    sys.stdout.write(f"{out}\n")


def described(words: Sequence[str], places: tuple[str, ...] = ()) -> Page:
    """Return the page of a run; nothing but its protocol is built. `places`: further configuration. Raises what is wrong, as `compose`."""
    composed = compose(words, (*places, *plugin_packages()))
    cfg = composed.cfg
    procedure = procedure_of(cfg, list(cfg.stage or {}))
    if procedure is None:
        raise BadInput("protocol=null was given, but a page is of a protocol. Type e.g. python -m oio.protocol bench.")
    sentences = dict(choices(CONF, "stage"))
    stages = {name: StageAbout(sentences.get(name, ""), tuple(_keys(f"stage.{name}", node))) for name, node in (cfg.stage or {}).items()}
    chosen = [(key, str(composed.choices[key])) for key in CHOSEN] + [(key, str(cfg[key])) for key in PLAIN]
    where = [(key, _place(cfg[key].position)) for key in ("beacon", "source")]
    return page(procedure, stages, tuple(chosen), tuple(where), _records(str(cfg.sensor.name)))


def _place(position: Any) -> str:
    return "not told to the run" if position is None else in_mm((float(position[0]), float(position[1]), float(position[2])))


def _keys(key: str, node: DictConfig) -> Iterator[tuple[str, str]]:
    """Keys of a stage's own with their values; parts that it shares with others, such as the sensor, are not its own."""
    for name in map(str, node):
        value = None if OmegaConf.is_missing(node, name) else node[name]
        if isinstance(value, DictConfig):
            yield from () if OmegaConf.is_interpolation(node, name) else _keys(f"{key}.{name}", value)
        elif name != "_target_":
            yield f"{key}.{name}", str(value)


def _records(sensor: str) -> tuple[tuple[str, str], ...]:
    return (
        (f"run.mcap, /gas/{sensor}/sample", "every raw sample of the sensor"),
        ("run.mcap, /arm/joint_states", "every joint state from the encoders"),
        ("run.mcap, /estimate/...", "beliefs and innovations"),
        ("run.mcap, /events", "moves, sources, and every step of this protocol with its answer"),
        ("config.yaml", "every number of the run"),
        ("calibration.yaml", "the calibration, if assemble_qr is among the stages"),
        ("summary.json", "results, answers, and whether the run is reproducible"),
    )
