"""Keys that nobody reads: what a typed word or an experiment added to the configuration, and no class, command or interpolation takes."""

import re
from collections.abc import Iterator
from typing import Any

from omegaconf import DictConfig, OmegaConf

from oio.cli.known_keys import known_keys, nearest
from oio.core.errors import BadInput
from oio.core.folders import CONF

_REFERENCE = re.compile(r"\$\{([^}:$]+)\}")


def refuse_unread(cfg: DictConfig) -> None:
    """Raise BadInput for a key that nobody reads, with the nearest that exists.

    What has a `_target_` is checked by its class as it is built, so only what stands outside of these is looked at.
    """
    plain = OmegaConf.to_container(cfg, resolve=False)
    known = set(known_keys(CONF))
    strange = [key for key in _outside_of_targets(plain, "") if key not in known]
    references = set(_references(plain)) if strange else set()
    for key in strange:
        if not any(_meets(key, reference) for reference in references):
            near = nearest(key, CONF)
            told = f" The nearest is '{near}': type {near}=VALUE." if near else ""
            raise BadInput(f"'{key}' was given, but nothing reads it.{told} `python -m oio.run --cfg job` prints every key.")


def _outside_of_targets(node: Any, prefix: str) -> Iterator[str]:
    for key, value in node.items():
        if isinstance(value, dict) and value:
            if "_target_" not in value:
                yield from _outside_of_targets(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}"


def _references(node: Any) -> Iterator[str]:
    """Keys that interpolations anywhere in the configuration name."""
    for value in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
        if isinstance(value, str):
            yield from _REFERENCE.findall(value)
        else:
            yield from _references(value)


def _meets(key: str, reference: str) -> bool:
    """Whether a reference takes the key, or a node that it is in."""
    return key == reference or key.startswith(f"{reference}.")
