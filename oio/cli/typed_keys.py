"""Keys as a person types them, for messages: what a class calls `StopRule.sd_m` and the run's first stage gets as
`stage.navigate.stop.sd_m` is typed as `stop.sd_m`, and conf/ has a value for it that can be typed instead."""

import re
from collections.abc import Mapping
from typing import Any

from hydra.errors import InstantiationException

from oio.cli.known_keys import shipped
from oio.core.errors import OioError
from oio.core.folders import CONF

_PASSES_ON = re.compile(r"\$\{(oc\.select:)?([\w.]+)(,[^${}]*)?\}")
_BUILT_AT = re.compile(r"full_key: (\S+)")
_FIELD = re.compile(r"[A-Z]\w*\.(\w+)")


def named(error: InstantiationException, plain: Mapping[str, Any]) -> OioError | None:
    """The error behind one of Hydra with the key as it is typed, and a value that can be; None if there is no known one behind it.

    `plain` is the configuration with its interpolations unresolved.
    """
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, OioError):
        cause = cause.__cause__
    if cause is None:
        return None
    text, at, field = str(cause), _BUILT_AT.search(str(error)), _FIELD.match(str(cause))
    if at is None or field is None:
        return type(cause)(text)
    key = typed_key(f"{at[1]}.{field[1]}", plain)
    text = f"{key}{text[field.end() :]}"
    return type(cause)(text if "Type " in text else f"{text}{example(key)}")


def typed_key(key: str, plain: Mapping[str, Any]) -> str:
    """Follow interpolations from a full key to where its value stands, e.g. from stage.navigate.stop.sd_m to stop.sd_m."""
    parts = key.split(".")
    node: Any = plain
    for i, part in enumerate(parts):
        node = node.get(part) if isinstance(node, Mapping) else None
        passed = _PASSES_ON.fullmatch(node) if isinstance(node, str) else None
        if passed and _exists(passed[2], plain):
            return typed_key(".".join((passed[2], *parts[i + 1 :])), plain)
    return key


def example(key: str) -> str:
    """A sentence with what conf/ has for a key, or for the first key below it; empty if it has nothing."""
    found = shipped(key, CONF)
    return f" Type e.g. {found[0]}={as_typed(found[1])}." if found else ""


def as_typed(value: Any) -> str:
    """A value as it is typed on the command line."""
    if isinstance(value, dict):
        return f"{{{','.join(f'{key}:{as_typed(inner)}' for key, inner in value.items())}}}"
    if isinstance(value, list):
        return f"[{','.join(map(as_typed, value))}]"
    return "null" if value is None else str(value).lower() if isinstance(value, bool) else str(value)


def _exists(key: str, plain: Mapping[str, Any]) -> bool:
    node: Any = plain
    for part in key.split("."):
        if not isinstance(node, Mapping) or part not in node:
            return False
        node = node[part]
    return True
