"""`built` composes conf/ with overrides, as a run would, and builds one key of it."""

import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import hypothesis
import pytest
from hydra import compose, initialize_config_dir
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

hypothesis.settings.register_profile("patient", deadline=None)  # the first call compiles
hypothesis.settings.load_profile("patient")

CONF = Path(__file__).resolve().parents[1] / "conf"
Composed = Callable[..., DictConfig]
Built = Callable[..., Any]


@functools.cache
def _composed(overrides: tuple[str, ...]) -> DictConfig:
    with initialize_config_dir(str(CONF), version_base="1.3"):
        return compose("config", list(overrides))


@functools.cache
def _built(key: str, overrides: tuple[str, ...]) -> Any:
    return instantiate(OmegaConf.select(_composed(overrides), key), _convert_="all")


@pytest.fixture(scope="session")
def composed() -> Composed:
    """composed("dof=3") is the configuration with these overrides."""
    return lambda *overrides: _composed(overrides)


@pytest.fixture(scope="session")
def built() -> Built:
    """built("arm", "dof=3") is the frozen thing that conf/ makes of one key; built once, because it is frozen."""
    return lambda key, *overrides: _built(key, overrides)
