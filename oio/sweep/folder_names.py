"""Folder names of jobs, made of their overrides."""

import functools
import re
from collections.abc import Sequence
from typing import Any

from hydra.core.override_parser.overrides_parser import OverridesParser
from omegaconf import DictConfig, OmegaConf

from oio.cli.compose import compose
from oio.core.errors import BadInput


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
        cfg = self._cfg if plain else compose(words, self._places).cfg
        value = OmegaConf.select(cfg, name.replace("hydra:", "hydra."))
        if value is None:
            given = f"hydra.sweep.subdir={self._pattern} was given, but '{name}' has no value for a job"
            raise BadInput(f"{given}. Type e.g. 'hydra.sweep.subdir=${{hydra:job.num}}'.")
        return str(value)


@functools.lru_cache(maxsize=4096)
def _parsed(word: str) -> tuple[str, Any]:
    override = OverridesParser.create().parse_override(word)
    return override.key_or_group, override.value()
