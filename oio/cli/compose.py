"""Configurations from overrides: composed once per choice, not per seed; raises what Hydra raises."""

import functools
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import hydra
from hydra.core.global_hydra import GlobalHydra
from omegaconf import DictConfig, OmegaConf

from oio.cli.plugins import search_path, without_search_path
from oio.core.folders import CONF

SEED = re.compile(r"seed=(\d+)")


@dataclass(frozen=True)
class Composed:
    """A composed configuration without its `hydra` part, and the choice made in every group."""

    cfg: DictConfig
    choices: dict[str, str]


def compose(words: Sequence[str], places: tuple[str, ...]) -> Composed:
    """Compose the configuration of a run from its overrides.

    `places` are further folders and packages on Hydra's search path, beside those of a `hydra.searchpath=` among the words.
    """
    words, own = without_search_path(words)
    seeds = [int(found[1]) for word in words if (found := SEED.fullmatch(word))]
    others = tuple(word for word in words if not SEED.fullmatch(word))
    plain, choices = _compose(others, (*own, *places))
    reseeded = {**plain, "seed": seeds[-1]} if seeds else plain
    return Composed(OmegaConf.create(reseeded), dict(choices))


@functools.lru_cache(maxsize=16)
def _compose(words: tuple[str, ...], places: tuple[str, ...]) -> tuple[dict[Any, Any], dict[str, str]]:
    """Return the configuration as plain data, its interpolations unresolved, and the choices. Not to be changed."""
    with _no_other_hydra(), hydra.initialize_config_dir(str(CONF), version_base="1.3"):
        composed = hydra.compose("config", [*words, *search_path(places)], return_hydra_config=True)
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
