"""The configuration of a run composed again from its overrides, and compared with the one in its log key by key."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import yaml
from omegaconf import OmegaConf

from oio.cli.build import build
from oio.cli.compose import compose
from oio.cli.experiment import Experiment
from oio.cli.replay_overrides import ANSWERS, OF_ITS_OWN, logged, quoted
from oio.core.errors import BadInput
from oio.reproduce.original import Original

NOWHERE = "nothing"


def experiment_again(made: Original, words: Sequence[str], places: tuple[str, ...]) -> tuple[Experiment, list[str]]:
    """Compose and build the run again; return it, and `KEY BEFORE -> NOW` of every key that the log has otherwise.

    Overrides of the log are data, and what is built is what conf/ names. `words` come after them; `places` are further configuration.
    """
    without = () if made.simulated else OF_ITS_OWN
    replay = [] if made.simulated else ["backend=replay", f"backend.log={quoted(made.log.resolve())}"]
    overrides = [*logged(made.log, but=words, without=without), *words, *replay]
    composed = compose(overrides, places)
    now = OmegaConf.to_container(composed.cfg, resolve=True)
    return build(composed.cfg, composed.choices, overrides), differing_keys(logged_configuration(made), now, (*without, ANSWERS))


def logged_configuration(made: Original) -> Any:
    """Return the configuration in a log, as data. Raises BadInput for one that cannot be read."""
    try:
        return yaml.safe_load(made.about.get("config", "")) or {}
    except yaml.YAMLError as error:
        raise BadInput(f"{made.log} has a configuration that cannot be read ({' '.join(str(error).split())}).") from None


def differing_keys(before: Any, now: Any, without: Sequence[str]) -> list[str]:
    """Return `KEY BEFORE -> NOW` of the leaves that differ, but those `without` and below them."""
    old, new = dict(_leaves(before)), dict(_leaves(now))
    keys = [key for key in {**old, **new} if not any(key == other or key.startswith(f"{other}.") for other in without)]
    return [f"{key} {old.get(key, NOWHERE)} -> {new.get(key, NOWHERE)}" for key in keys if old.get(key, NOWHERE) != new.get(key, NOWHERE)]


def _leaves(node: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(node, Mapping) and node:
        for name, value in node.items():
            yield from _leaves(value, f"{key}.{name}" if key else str(name))
    else:
        yield key, node
