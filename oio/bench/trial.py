"""One benchmark trial: a whole run as of `python -m oio.run`, but in memory. A process composes each configuration once."""

import functools
from typing import Any

from omegaconf import DictConfig, OmegaConf

from oio.cli.build import build, reseeded
from oio.cli.compose import compose
from oio.cli.experiment import Experiment
from oio.cli.hydra_errors import known_error
from oio.cli.plugins import plugin_packages
from oio.cli.trials import run_in_memory
from oio.core.errors import BadInput
from oio.core.folders import CONF


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
    if built.trials > 1:
        raise BadInput(
            f"trials={built.trials} was given, but a benchmark has a trial for each of its seeds. Type e.g. seeds=0:{built.trials}."
        )
    return cfg, built


def experiment(words: tuple[str, ...], seed: int) -> Experiment:
    """Return the experiment for one seed."""
    return reseeded(composed_trial(words)[1], seed)


def _plain(cfg: DictConfig) -> dict[Any, Any]:
    plain = OmegaConf.to_container(cfg)
    assert isinstance(plain, dict)
    return plain


def run_trial(words: tuple[str, ...], seed: int) -> dict[str, Any]:
    """Return the summary of a run, without its wall-clock time."""
    built = experiment(words, seed)
    document = run_in_memory(built)
    if document["calibration"] is None or document["calibrated"] is None:
        raise BadInput(f"the stages were {list(built.stages)}, but a benchmark needs 'assemble_qr' and 'evaluate'. Leave stage= out.")
    return document


def try_trial(words: tuple[str, ...], seed: int) -> tuple[dict[str, Any] | None, str]:
    """Return the summary, or None and the reason of the failure: a failed trial does not stop the others."""
    try:
        return run_trial(words, seed), ""
    except Exception as error:
        return None, str(known_error(error, CONF) or repr(error))
