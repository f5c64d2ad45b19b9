"""The command `python -m oio.run`: compose, build, check, run. Known errors end in one paragraph: exit code 2 for bad input, else 1."""

import json
import os
import sys
from pathlib import Path
from typing import Any

import hydra
from hydra._internal.utils import get_args_parser
from hydra.core.hydra_config import HydraConfig
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.types import RunMode
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from oio.cli.console import show_summary
from oio.cli.exit_codes import run_command
from oio.cli.experiment import Experiment, execute
from oio.cli.help import show_help
from oio.cli.hydra_errors import known_error
from oio.cli.plugins import config_folders, plugin_packages, search_path
from oio.cli.replay_overrides import replayed
from oio.cli.sweep_table import SweepTable
from oio.core import interrupt
from oio.core.errors import BadInput, OioError
from oio.core.folders import CONF, ROOT
from oio.runtime.runner import check_order

ASSEMBLIES = ("gum", "paper")
FAILED: list[Exception] = []  # the error of a single run


def build(cfg: DictConfig, choices: dict[str, str], overrides: list[str]) -> Experiment:
    """Build the experiment of a configuration; all frozen, no I/O. Raises BadInput, or what Hydra raises, for anything wrong."""
    missing = sorted(OmegaConf.missing_keys(cfg))
    if missing:
        raise BadInput(f"{missing[0]} has no value. Type {missing[0]}=VALUE.")
    if cfg.assembly not in ASSEMBLIES:
        raise BadInput(f"assembly={cfg.assembly} was given, but assembly can be {' or '.join(ASSEMBLIES)}. Type e.g. assembly=gum.")
    _whole("dof", cfg.dof, f"a rung of the ladder: {', '.join(map(str, cfg.arm.ladder))}", str(cfg.arm.ladder[-1]))
    _whole("seed", cfg.seed, "a whole number, 0 or more", "0")
    names = {key: choices[key] for key in ("backend", "air", "ekf")}
    plain = {key: cfg[key] for key in ("dof", "assembly", "seed")}
    world = cfg.world.name if "world" in cfg.backend else None  # a simulated one
    _check_world(choices["backend"], overrides, world is not None)
    identity = {"sensor": cfg.sensor.name, "profile": cfg.profile.name, **plain, **names, "world": world}
    stages = {name: instantiate(node) for name, node in (cfg.stage or {}).items()}
    if not stages:
        raise BadInput("stage=[] was given, but at least one stage is needed. Type e.g. stage=[warm_up,baseline].")
    experiment = Experiment(
        arm=instantiate(cfg.arm), sensor=instantiate(cfg.sensor), backend=instantiate(cfg.backend), stages=stages,
        identity=identity,
        config_yaml=OmegaConf.to_yaml(cfg, resolve=True), overrides=overrides,
    )  # fmt: skip
    check_order(experiment.stages)
    return experiment


def _check_world(backend: str, overrides: list[str], simulated: bool) -> None:
    changed = [given for given in overrides if given.lstrip("+").startswith(("world=", "world.")) and given != "world=unchanged"]
    if changed and not simulated:
        given = f"{changed[0]} changes the simulated world, but backend={backend} is not simulated"
        raise BadInput(f"{given}. Leave it out, or type backend=mujoco.")


def _whole(key: str, value: object, allowed: str, example: str) -> None:
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        given = "null" if value is None else value
        raise BadInput(f"{key}={given} was given, but {key} is {allowed}. Type e.g. {key}={example}.")


def job(cfg: DictConfig) -> dict[str, Any]:
    """Hydra's task function. In a sweep a failure is written to the job's own status.json, so that the others go on."""
    told = HydraConfig.get()
    out, sweeping = Path(told.runtime.output_dir), told.mode == RunMode.MULTIRUN
    try:
        document = execute(build(cfg, dict(told.runtime.choices), list(told.overrides.task)), out)
    except Exception as error:
        if sweeping:
            _note_failure(out, error)
        else:
            _leave_nothing(out)
            FAILED.append(error)  # raised through Hydra it would be printed twice
        return {}
    if not sweeping:
        show_summary(document, f"log, calibration and numbers are in {out}")
    return document


def _leave_nothing(out: Path) -> None:
    if out.is_dir() and not any(out.iterdir()):
        out.rmdir()


def _note_failure(out: Path, error: Exception) -> None:
    if (out / "status.json").is_file():
        return  # the run itself has written it
    known = known_error(error, CONF)
    text = str(known or repr(error))
    (out / "status.json").write_text(json.dumps({"state": "failed", "error": text, "traceback": None}) + "\n", encoding="utf-8")


def refuse_bad_choices(arguments: list[str]) -> None:
    """Before a sweep: compose and build every value of every swept key, with the first values of the others."""
    words = get_args_parser().parse_args(arguments).overrides
    parsed = OverridesParser.create().parse_overrides(words)
    swept = [o for o in parsed if o.is_sweep_override() and not o.is_hydra_override()]
    values = {o.key_or_group: list(o.sweep_string_iterator()) for o in swept}
    plain = [w for w, o in zip(words, parsed, strict=True) if not o.is_sweep_override() and not w.startswith("hydra")]
    plain += search_path([f"file://{folder.resolve()}" for folder in config_folders(arguments)] + plugin_packages())
    first = {key: options[0] for key, options in values.items()}
    with hydra.initialize_config_dir(str(CONF), version_base="1.3"):
        for key, options in values.items():
            for value in options:
                chosen = {**first, key: value}
                cfg = hydra.compose("config", [*plain, *(f"{k}={v}" for k, v in chosen.items())], return_hydra_config=True)
                choices = dict(cfg.hydra.runtime.choices)
                build(OmegaConf.masked_copy(cfg, [str(k) for k in cfg if k != "hydra"]), choices, [])


def _check_packages() -> None:
    """Refuse to start where `hardware` or `pipelines` is another distribution's package, and not the one beside `oio`."""
    for name in ("pipelines", "hardware"):
        if not (ROOT / name / "__init__.py").is_file():
            raise BadInput(f"the package '{name}' does not lie beside 'oio' in {ROOT}. Install OIO in a venv of its own: make venv.")
    sys.path.insert(0, str(ROOT))


def _run(arguments: list[str]) -> None:
    _check_packages()
    if {"--help", "-h"} & set(arguments):
        return show_help(CONF, *config_folders(arguments))
    arguments = [*replayed(arguments), *search_path(plugin_packages())]
    if {"-m", "--multirun"} & set(arguments):
        refuse_bad_choices(arguments)
    os.environ["HYDRA_FULL_ERROR"] = "1"  # errors are printed by `run_command`, as one paragraph
    sys.argv = [sys.argv[0], *arguments]
    hydra.main(version_base="1.3", config_path=str(CONF), config_name="config")(job)()
    if FAILED:
        raise FAILED[0]
    if SweepTable.failed:
        raise OioError(f"{SweepTable.failed} jobs of the sweep failed; their status.json says why.")


def main() -> int:
    """Run the command; returns the exit code."""
    interrupt.listen()
    return run_command(lambda: _run(sys.argv[1:]), "stopped; what was logged so far can be read (python -m oio.recover RUN/run.mcap.part).")
