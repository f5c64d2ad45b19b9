"""One benchmark trial: a whole run as of `python -m oio.run`, but in memory. A process composes each configuration once."""

import functools
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from oio.cli.build import build
from oio.cli.compose import compose
from oio.cli.experiment import Experiment
from oio.cli.hydra_errors import known_error
from oio.cli.plugins import plugin_packages
from oio.core.errors import BadInput
from oio.core.folders import CONF
from oio.log import MemoryLog
from oio.results.calibration import Calibration
from oio.results.evaluation import Evaluation
from oio.results.summary import summary
from oio.results.verdict import judge
from oio.runtime.runner import run_stages


@functools.lru_cache(maxsize=32)
def composed_trial(words: tuple[str, ...]) -> tuple[dict[str, Any], Experiment]:
    """Return the configuration with these overrides as plain data, and the experiment built from it; raises Hydra's or a check's error."""
    composed = compose(words, tuple(plugin_packages()))
    cfg = {str(key): value for key, value in _plain(composed.cfg).items()}
    if "evaluate" in (cfg["stage"] or {}):
        cfg["stage"]["evaluate"].update(paper_assembly=False, cold_maps="last")  # no benchmark reads more, and the rest is slow
    built = build(OmegaConf.create(cfg), composed.choices, list(words))
    if built.procedure is not None:
        raise BadInput(f"protocol={built.procedure.name} was given, but a benchmark asks nobody and waits for nothing. Leave it out.")
    return cfg, built


def experiment(words: tuple[str, ...], seed: int) -> Experiment:
    """Return the experiment for one seed. Seeds reach the backend and the stages' random streams, so only the backend is rebuilt."""
    cfg, any_seed = composed_trial(words)
    reseeded = OmegaConf.create({**cfg, "seed": seed})  # Hydra has resolved the first configuration for good, its seed included
    return replace(any_seed, backend=instantiate(reseeded.backend), identity={**any_seed.identity, "seed": seed})


def _plain(cfg: DictConfig) -> dict[Any, Any]:
    plain = OmegaConf.to_container(cfg)
    assert isinstance(plain, dict)
    return plain


def run_trial(words: tuple[str, ...], seed: int) -> dict[str, Any]:
    """Return the summary of a run, without its wall-clock time."""
    built = experiment(words, seed)
    with tempfile.TemporaryDirectory() as folder, built.backend.open() as world:
        results = run_stages(built.stages, world, built.arm, MemoryLog(), Path(folder), seed, built.sensor.highest_raw)
    calibration, found = results.get(Calibration), results.get(Evaluation)
    if not isinstance(calibration, Calibration) or not isinstance(found, Evaluation):
        raise BadInput(f"the stages were {list(built.stages)}, but a benchmark needs 'assemble_qr' and 'evaluate'. Leave stage= out.")
    return summary(built.identity, calibration, found, judge(results, built.verdict), 0.0)


def try_trial(words: tuple[str, ...], seed: int) -> tuple[dict[str, Any] | None, str]:
    """Return the summary, or None and the reason of the failure: a failed trial does not stop the others."""
    try:
        return run_trial(words, seed), ""
    except Exception as error:
        return None, str(known_error(error, CONF) or repr(error))
