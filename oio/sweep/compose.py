"""Configurations of many jobs: composed once per choice, not per seed; raises what Hydra and the checks raise."""

import functools
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import hydra
from hydra.core.global_hydra import GlobalHydra
from hydra.core.override_parser.overrides_parser import OverridesParser
from omegaconf import DictConfig, OmegaConf

from oio.core.errors import BadInput
from oio.core.folders import CONF

SEED = re.compile(r"seed=(\d+)")


@dataclass(frozen=True)
class Composed:
    """A composed configuration without its `hydra` part, and the choice made in every group."""

    cfg: DictConfig
    choices: dict[str, str]


def compose_job(words: Sequence[str], places: tuple[str, ...]) -> Composed:
    """Compose the configuration of a job from its overrides; `places` are further folders on Hydra's search path."""
    seeds = [int(found[1]) for word in words if (found := SEED.fullmatch(word))]
    others = tuple(word for word in words if not SEED.fullmatch(word))
    plain, choices = _compose(others, places)
    reseeded = {**plain, "seed": seeds[-1]} if seeds else plain
    return Composed(OmegaConf.create(reseeded), dict(choices))


@functools.lru_cache(maxsize=16)
def _compose(words: tuple[str, ...], places: tuple[str, ...]) -> tuple[dict[Any, Any], dict[str, str]]:
    """Return the configuration as plain data, its interpolations unresolved, and the choices. Not to be changed."""
    folders = [f"hydra.searchpath=[{','.join(places)}]"] if places else []
    with _no_other_hydra(), hydra.initialize_config_dir(str(CONF), version_base="1.3"):
        composed = hydra.compose("config", [*words, *folders], return_hydra_config=True)
    plain = OmegaConf.to_container(composed)
    assert isinstance(plain, dict)
    return {key: value for key, value in plain.items() if key != "hydra"}, dict(composed.hydra.runtime.choices)


@contextmanager
def _no_other_hydra() -> Iterator[None]:
    """Put Hydra's global state aside: it allows one composition at a time, and a sweep is one."""
    state = GlobalHydra.instance()
    kept, state.hydra = state.hydra, None
    try:
        yield
    finally:
        state.hydra = kept


class FolderNames:
    """Folder names of jobs: `hydra.sweep.subdir`, resolved without composing every job where it names keys and choices only."""

    def __init__(self, cfg: DictConfig, places: tuple[str, ...]) -> None:
        """`cfg` is Hydra's configuration of the sweep."""
        self._cfg, self._places = cfg, places
        self._choices = {str(key): value for key, value in cfg.hydra.runtime.choices.items()}
        sweep = OmegaConf.to_container(cfg.hydra.sweep, resolve=False)
        assert isinstance(sweep, dict)
        self._pattern = str(sweep["subdir"])

    def of(self, number: int, words: Sequence[str]) -> str:
        """Return the folder of a job, relative to the sweep's. Raises BadInput if a part of it cannot be resolved."""
        told = {"hydra:job.num": str(number), "hydra:job.id": str(number), "hydra:job.override_dirname": ",".join(words)}
        told |= {f"hydra:runtime.choices.{key}": str(value) for key, value in self._choices.items()}
        for word in words:
            key, value = _parsed(word)
            told[f"hydra:runtime.choices.{key}" if key in self._choices else key] = str(value)
        return re.sub(r"\$\{([^{}]*)\}", lambda found: told.get(found[1]) or self._composed(found[1], words), self._pattern)

    def _composed(self, name: str, words: Sequence[str]) -> str:
        plain = name.startswith("hydra:") or (name in self._cfg and not OmegaConf.is_interpolation(self._cfg, name))
        cfg = self._cfg if plain else compose_job(words, self._places).cfg
        value = OmegaConf.select(cfg, name.replace("hydra:", "hydra."))
        if value is None:
            given = f"hydra.sweep.subdir={self._pattern} was given, but '{name}' has no value for a job"
            raise BadInput(f"{given}. Type e.g. 'hydra.sweep.subdir=${{hydra:job.num}}'.")
        return str(value)


@functools.lru_cache(maxsize=4096)
def _parsed(word: str) -> tuple[str, Any]:
    override = OverridesParser.create().parse_override(word)
    return override.key_or_group, override.value()
