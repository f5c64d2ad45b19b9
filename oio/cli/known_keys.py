"""Keys of the configuration as a person can type them, from the files in `conf/`, and the nearest of them to one that does not exist."""

import difflib
import functools
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from oio.results.yaml_fields import SAFE

OF_OTHER_COMMANDS = ("bench.yaml", "emulate.yaml")
NEAR, SAME_NAME = 0.6, 0.5  # least similarity (difflib's ratio) of a key, and of one whose last word is the same


def nearest(key: str, conf: Path) -> str | None:
    """Return the key that is most like `key`, e.g. stop.sd_m for stop.sd_mm; one with the same last word first. None if none is near."""
    keys = [known for known in known_keys(conf) if not key.startswith(f"{known}.")]
    same = [known for known in keys if known.rsplit(".", 1)[-1] == key.rsplit(".", 1)[-1]]
    found = difflib.get_close_matches(key, same, 3, SAME_NAME) or difflib.get_close_matches(key, keys, 3, NEAR)
    return next((near for near in found if sorted(near) == sorted(key)), found[0] if found else None)  # letters swapped, before all else


def owner(key: str, conf: Path) -> str | None:
    """Return the choice of a group in whose YAML the key stands, e.g. `replay` for backend.log; None if there is none."""
    group, _, rest = key.partition(".")
    choices = (path.stem for path in sorted((conf / group).glob("*.yaml")) if rest)
    return next((choice for choice in choices if rest in _keys_of(conf / group / f"{choice}.yaml")), None)


def shipped(key: str, conf: Path) -> tuple[str, Any] | None:
    """Return a key with the value that a file in conf/ gives it; without one the first key below it, e.g. stop.sd_m for stop."""
    values = {known: value for known, value in reversed(_pairs(conf)) if not (isinstance(value, str) and "$" in value)}
    passed = next((re.fullmatch(r"\$\{([\w.]+)\}", str(value)) for known, value in _pairs(conf) if known == key), None)
    if passed and passed[1] in values:
        return key, values[passed[1]]
    below = (known for known, _ in _pairs(conf) if known.startswith(f"{key}.") and known in values)
    found = key if key in values else next(below, None)
    return None if found is None else (found, values[found])


@functools.cache
def known_keys(conf: Path) -> tuple[str, ...]:
    """Return every key of every choice, e.g. stop.sd_m, and the names of groups; none that only passes on another key of its name."""
    groups = sorted(path.name for path in conf.iterdir() if path.is_dir() and path.name != "experiment")
    return tuple(dict.fromkeys([*(key for key, _ in _pairs(conf)), *groups]))


@functools.cache
def _pairs(conf: Path) -> tuple[tuple[str, Any], ...]:
    """Every key of every choice with its value."""
    roots = [path for path in sorted(conf.glob("*.yaml")) if path.name not in OF_OTHER_COMMANDS]
    pairs = [(f"{'' if path.stem == 'config' else f'{path.stem}.'}{key}", value) for path in roots for key, value in _pairs_of(path)]
    for group in sorted(path for path in conf.iterdir() if path.is_dir() and path.name != "experiment"):
        pairs += [(f"{group.name}.{key}", value) for path in sorted(group.glob("*.yaml")) for key, value in _pairs_of(path)]
    return tuple(pairs)


def _keys_of(path: Path) -> tuple[str, ...]:
    return tuple(key for key, _ in _pairs_of(path))


@functools.cache
def _pairs_of(path: Path) -> tuple[tuple[str, Any], ...]:
    document = yaml.load(path.read_text(encoding="utf-8"), SAFE)
    return tuple(_leaves(document, "")) if isinstance(document, dict) else ()


def _leaves(node: dict[Any, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    for key, value in node.items():
        if key in ("_target_", "defaults", "hydra") or value == f"${{{key}}}":
            continue
        if isinstance(value, dict) and value and all(isinstance(inner, str) for inner in value):
            yield from _leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
