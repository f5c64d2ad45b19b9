"""From a composed configuration to an experiment: every choice built and checked, all frozen, no I/O."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from hydra.errors import InstantiationException
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from oio.cli.experiment import Experiment
from oio.cli.typed_keys import named
from oio.cli.unread_keys import refuse_unread
from oio.core.errors import BadInput
from oio.procedure.procedure import Procedure
from oio.results.calibration import Calibration, MapCalibration
from oio.results.evaluation import Evaluation
from oio.runtime.runner import Stage, check_order, result_type
from oio.view.base import NoView

ASSEMBLIES = ("gum", "paper")
LOGGING = ("full", "summary")
LOADS = "load_calibration"
BUILT_AT_MOST = 128
_BUILT: dict[str, Any] = {}


def build(cfg: DictConfig, choices: dict[str, str], overrides: list[str]) -> Experiment:
    """Build the experiment of a configuration; all frozen, no I/O. Raises BadInput, or what Hydra raises, for anything wrong."""
    plain: Any = OmegaConf.to_container(cfg, resolve=False)  # before Hydra resolves it
    try:
        return replace(_build(cfg, choices, overrides), plain=plain)
    except InstantiationException as error:
        known = named(error, plain)
        if known is None:
            raise
        raise known from error


def reseeded(experiment: Experiment, seed: int) -> Experiment:
    """Return the experiment for another seed. Seeds reach the backend and the stages' random streams, so only the backend is built anew."""
    cfg = OmegaConf.create({**experiment.plain, "seed": seed})  # Hydra has resolved the first configuration for good, its seed included
    backend = instantiate(cfg.backend, _convert_="all")
    return replace(experiment, backend=backend, identity={**experiment.identity, "seed": seed})


def _build(cfg: DictConfig, choices: dict[str, str], overrides: list[str]) -> Experiment:
    missing = sorted(OmegaConf.missing_keys(cfg))
    if missing:
        raise BadInput(f"{missing[0]} has no value. Type {missing[0]}=VALUE.")
    refuse_unread(cfg)
    if cfg.assembly not in ASSEMBLIES:
        raise BadInput(f"assembly={cfg.assembly} was given, but assembly can be {' or '.join(ASSEMBLIES)}. Type e.g. assembly=gum.")
    if cfg.logging not in LOGGING:
        raise BadInput(f"logging={cfg.logging} was given, but logging can be {' or '.join(LOGGING)}. Type e.g. logging=full.")
    if not isinstance(cfg.report, bool):
        raise BadInput(f"report={cfg.report} was given, but report can be true or false. Type e.g. report=false.")
    rungs = [str(rung) for rung in cfg.arm.ladder or (1, 2, 3, "the number of its joints")]
    _whole("dof", cfg.dof, f"a rung of the ladder: {', '.join(rungs)}", rungs[-1] if cfg.arm.ladder else "3")
    _whole("seed", cfg.seed, "a whole number, 0 or more", "0")
    _whole("trials", cfg.trials, "a whole number, 1 or more", "100", least=1)
    cfg.sensor_serial = _label(cfg.sensor_serial)
    names = {key: choices[key] for key in ("backend", "air", "ekf")}
    plain = {key: cfg[key] for key in ("dof", "assembly", "seed")}
    world = cfg.world.name if "world" in cfg.backend else None  # a simulated one
    _check_world(choices["backend"], overrides, world is not None)
    identity = {
        "sensor": cfg.sensor.name,
        "profile": cfg.profile.name,
        **plain,
        **names,
        "world": world,
        "sensor_serial": cfg.sensor_serial,
    }
    _refuse_repeated(overrides)
    stages = _stages(cfg)
    if not stages:
        raise BadInput("stage=[] was given, but at least one stage is needed. Type e.g. stage=[warm_up,baseline].")
    experiment = Experiment(
        arm=_built(cfg.arm), sensor=_built(cfg.sensor), backend=_built(cfg.backend), stages=stages,
        verdict=_built(cfg.verdict), identity=identity,
        procedure=procedure_of(cfg, list(stages)),
        config_yaml=OmegaConf.to_yaml(cfg, resolve=True), overrides=overrides, logged=cfg.logging == "full",
        view=_built(cfg.view), beacon_m=None if cfg.beacon.position is None else np.array(cfg.beacon.position, dtype=float),
        trials=cfg.trials,
    )  # fmt: skip
    _build_typed(cfg, overrides)
    check_order(experiment.stages)
    if experiment.trials > 1:
        _refuse_trials(experiment, choices)
    return experiment


def _build_typed(cfg: DictConfig, overrides: list[str]) -> None:
    """Build the outermost node of every typed key, so that a wrong value is refused even where none of the stages reads it."""
    for word in overrides:
        node: Any = cfg
        for part in word.lstrip("+~").partition("=")[0].split("."):
            node = OmegaConf.select(node, part) if OmegaConf.is_dict(node) else None
            if OmegaConf.is_dict(node) and "_target_" in node:
                _built(node)
                break


def _refuse_repeated(overrides: list[str]) -> None:
    """Refuse a stage that is typed twice: the composition has room for one of a name, and it would run once without a word."""
    for typed in (word for word in overrides if word.startswith("stage=[")):
        names = [name.strip(" '\"") for name in typed.removeprefix("stage=[").rstrip("]").split(",")]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice:
            example = f"stage=[{','.join(dict.fromkeys(names))}]"
            raise BadInput(f"{typed} was given, but {twice} can run once in a run. Type {example}, and repeat the run for another one.")


def _label(given: object) -> str | None:
    """A serial number as text; digits alone arrive as a number."""
    if given is None or isinstance(given, str) or type(given) is int:
        return None if given is None else str(given)
    raise BadInput(f"sensor_serial={given} was given, but it must be a text, or null. Put it in quotes: \"sensor_serial='{given}'\".")


def _stages(cfg: DictConfig) -> dict[str, Stage]:
    """The stages in order; with calibration=FILE the one that loads it comes before the first that needs a calibration."""
    stages = {name: _built(node) for name, node in (cfg.stage or {}).items()}
    if cfg.calibration is None and LOADS in stages:
        raise BadInput(f"stage '{LOADS}' was given, but no calibration. Type calibration=RUN/calibration.yaml, of an earlier run.")
    if cfg.calibration is None or LOADS in stages:
        return stages
    makes = [name for name, stage in stages.items() if result_type(stage) in (MapCalibration, Calibration)]
    if makes:
        given = f"calibration={cfg.calibration} was given, but the stages {', '.join(makes)} make one"
        raise BadInput(f"{given}. Type stage=[navigate,evaluate], or stage=[warm_up,baseline,navigate,evaluate] for a baseline of today.")
    names = list(stages)
    at = next((i for i, name in enumerate(names) if Calibration in stages[name].needs), len(names))
    return {name: stages[name] for name in names[:at]} | {LOADS: _built(cfg[LOADS])} | {name: stages[name] for name in names[at:]}


def procedure_of(cfg: DictConfig, stages: list[str]) -> Procedure | None:
    """Build the protocol of a run of these stages; None without one. Raises BadInput for a step at another stage."""
    if cfg.get("protocol") is None:
        return None
    made = instantiate(cfg.protocol, _convert_="all")  # a list of OmegaConf would make configurations of its steps again
    if not isinstance(made, Procedure):
        raise BadInput("protocol has another _target_ than oio.procedure.procedure.Procedure. Type e.g. protocol=bench.")
    made.check_stages(stages)
    return made


def _built(node: DictConfig) -> Any:
    """Build a node of the configuration, once per process: what is built is frozen, so that jobs of a sweep may share it."""
    text = repr(OmegaConf.to_container(node, resolve=True))
    if text not in _BUILT:
        while len(_BUILT) >= BUILT_AT_MOST:
            del _BUILT[next(iter(_BUILT))]
        _BUILT[text] = instantiate(node, _convert_="all")
    return _BUILT[text]


def _check_world(backend: str, overrides: list[str], simulated: bool) -> None:
    changed = [given for given in overrides if given.lstrip("+").startswith(("world=", "world.")) and given != "world=unchanged"]
    if changed and not simulated:
        given = f"{changed[0]} changes the simulated world, but backend={backend} is not simulated"
        raise BadInput(f"{given}. Leave it out, or type backend=mujoco.")


def _refuse_trials(experiment: Experiment, choices: Mapping[str, str]) -> None:
    """Refuse what cannot be repeated with other seeds, or what would show or score nothing."""
    given = f"trials={experiment.trials} was given"
    if experiment.identity["world"] is None:
        raise BadInput(f"{given}, but backend={choices['backend']} is not simulated, and has no other seed. Leave it out.")
    if experiment.procedure is not None:
        raise BadInput(f"{given}, but protocol={experiment.procedure.name} asks a person in every run. Leave one of them out.")
    if not isinstance(experiment.view, NoView):
        raise BadInput(f"{given}, but view={choices['view']} shows a single run. Leave one of them out.")
    if not any(result_type(stage) is Evaluation for stage in experiment.stages.values()):
        raise BadInput(f"{given}, but without the stage 'evaluate' no trial has a result. Leave stage= out.")


def _whole(key: str, value: object, allowed: str, example: str, least: int = 0) -> None:
    if not isinstance(value, int) or isinstance(value, bool) or value < least:
        given = "null" if value is None else value
        raise BadInput(f"{key}={given} was given, but {key} is {allowed}. Type e.g. {key}={example}.")
