"""From a composed configuration to an experiment: every choice built and checked, all frozen, no I/O."""

from typing import Any

import numpy as np
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from oio.cli.experiment import Experiment
from oio.core.errors import BadInput
from oio.runtime.runner import check_order

ASSEMBLIES = ("gum", "paper")
LOGGING = ("full", "summary")
BUILT_AT_MOST = 128
_BUILT: dict[str, Any] = {}


def build(cfg: DictConfig, choices: dict[str, str], overrides: list[str]) -> Experiment:
    """Build the experiment of a configuration; all frozen, no I/O. Raises BadInput, or what Hydra raises, for anything wrong."""
    missing = sorted(OmegaConf.missing_keys(cfg))
    if missing:
        raise BadInput(f"{missing[0]} has no value. Type {missing[0]}=VALUE.")
    if cfg.assembly not in ASSEMBLIES:
        raise BadInput(f"assembly={cfg.assembly} was given, but assembly can be {' or '.join(ASSEMBLIES)}. Type e.g. assembly=gum.")
    if cfg.logging not in LOGGING:
        raise BadInput(f"logging={cfg.logging} was given, but logging can be {' or '.join(LOGGING)}. Type e.g. logging=full.")
    _whole("dof", cfg.dof, f"a rung of the ladder: {', '.join(map(str, cfg.arm.ladder))}", str(cfg.arm.ladder[-1]))
    _whole("seed", cfg.seed, "a whole number, 0 or more", "0")
    names = {key: choices[key] for key in ("backend", "air", "ekf")}
    plain = {key: cfg[key] for key in ("dof", "assembly", "seed")}
    world = cfg.world.name if "world" in cfg.backend else None  # a simulated one
    _check_world(choices["backend"], overrides, world is not None)
    identity = {"sensor": cfg.sensor.name, "profile": cfg.profile.name, **plain, **names, "world": world}
    stages = {name: _built(node) for name, node in (cfg.stage or {}).items()}
    if not stages:
        raise BadInput("stage=[] was given, but at least one stage is needed. Type e.g. stage=[warm_up,baseline].")
    experiment = Experiment(
        arm=_built(cfg.arm), sensor=_built(cfg.sensor), backend=_built(cfg.backend), stages=stages,
        identity=identity,
        config_yaml=OmegaConf.to_yaml(cfg, resolve=True), overrides=overrides, logged=cfg.logging == "full",
        view=_built(cfg.view), beacon_m=None if cfg.beacon.position is None else np.array(cfg.beacon.position, dtype=float),
    )  # fmt: skip
    check_order(experiment.stages)
    return experiment


def _built(node: DictConfig) -> Any:
    """Build a node of the configuration, once per process: what is built is frozen, so that jobs of a sweep may share it."""
    text = repr(OmegaConf.to_container(node, resolve=True))
    if text not in _BUILT:
        while len(_BUILT) >= BUILT_AT_MOST:
            del _BUILT[next(iter(_BUILT))]
        _BUILT[text] = instantiate(node)
    return _BUILT[text]


def _check_world(backend: str, overrides: list[str], simulated: bool) -> None:
    changed = [given for given in overrides if given.lstrip("+").startswith(("world=", "world.")) and given != "world=unchanged"]
    if changed and not simulated:
        given = f"{changed[0]} changes the simulated world, but backend={backend} is not simulated"
        raise BadInput(f"{given}. Leave it out, or type backend=mujoco.")


def _whole(key: str, value: object, allowed: str, example: str) -> None:
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        given = "null" if value is None else value
        raise BadInput(f"{key}={given} was given, but {key} is {allowed}. Type e.g. {key}={example}.")
