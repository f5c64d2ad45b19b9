"""`--help KEY`: every key at or below it with its value, the range that is allowed, and what is written beside it in conf/."""

import importlib
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, is_dataclass, replace
from pathlib import Path

import yaml
from rich.console import Console
from rich.text import Text

from oio.cli import terminal
from oio.cli.hanging_text import print_hanging
from oio.cli.known_keys import OF_OTHER_COMMANDS, nearest
from oio.cli.yaml_comments import WrittenKey, bases, heading, written_keys
from oio.core.errors import BadInput
from oio.core.ranges import Within, declared

INDENT = "    "


@dataclass(frozen=True, slots=True)
class Choice:
    """One YAML: the group that it is a choice of (empty: of none), its name, and what to put before its keys."""

    group: str
    name: str
    prefix: str
    keys: tuple[WrittenKey, ...]
    about: str = ""

    def at(self, key: str) -> list[WrittenKey]:
        """Keys, with their full names, that are `key` or below it."""
        full = (replace(written, key=f"{self.prefix}{written.key}") for written in self.keys)
        return [written for written in full if f"{written.key}.".startswith(f"{key}.")]


def show_keys(words: Sequence[str], folders: Sequence[Path]) -> None:
    """Print the help for keys (`stop`, `sensor.spread.gain`) and choices (`sensor=ndir`), from folders like conf/, the project's first.

    Raises BadInput for what is neither.
    """
    console = terminal.console(soft_wrap=True)
    made = all_choices(folders)
    ranges = Ranges(made)
    for word in words:
        for choice, keys in _found(word, made, folders[0]):
            if choice.group:
                console.print(Text(f"{choice.group}={choice.name}", style="bold"))
            if choice.group and len(keys) == len(choice.keys):
                print_hanging(console, INDENT, choice.about)
            for key in keys:
                _print_key(console, key, ranges)


def all_choices(folders: Sequence[Path]) -> list[Choice]:
    """Return every choice of folders like conf/, the project's first, and its files without a group.

    Raises BadInput for what is no YAML.
    """
    return [choice for folder in folders for choice in _choices(folder, folders[0])]


def _print_key(console: Console, key: WrittenKey, ranges: "Ranges") -> None:
    allowed = ranges.of(key) if key.value else None
    told = f"   {allowed} is allowed" if allowed else ""
    console.print(Text.assemble("  ", (f"{key.key}={key.value}" if key.value else key.key, "cyan"), told), soft_wrap=True)
    if comment := key.comment or ranges.comment(key):
        print_hanging(console, INDENT, comment)


def _found(word: str, made: list[Choice], conf: Path) -> list[tuple[Choice, list[WrittenKey]]]:
    """The choices that a word means, each with its keys."""
    key, equals, name = word.lstrip("+~").partition("=")
    usual = _defaults(conf)
    if key in {choice.group for choice in made if choice.group}:
        if equals or key in usual:
            return [_chosen(key, name if equals else usual[key], made)]
        if key != "stage":
            raise BadInput(f"{key} has no default. Say which, e.g. {_first(key, made)}; --help alone lists them.")
    having = [(choice, found) for choice in made if (found := choice.at(key))]
    if not having:
        near = nearest(key, conf)
        raise BadInput(f"there is no key {key}.{f' The nearest is {near}.' if near else ''} Type --help alone for the choices.")
    return [pair for pair in having if usual.get(pair[0].group, pair[0].name) == pair[0].name] or having


def _chosen(group: str, name: str, made: list[Choice]) -> tuple[Choice, list[WrittenKey]]:
    """One choice with all its keys; of two of a name that of the user's own folder."""
    chosen = {choice.name: choice for choice in made if choice.group == group}
    if name not in chosen:
        raise BadInput(f"there is no {group}={name}; {group} can be {', '.join(chosen)}. Type e.g. {_first(group, made)}.")
    return chosen[name], chosen[name].at(group)


def _first(group: str, made: list[Choice]) -> str:
    return f"python -m oio.run --help {group}={next(choice.name for choice in made if choice.group == group)}"


def _defaults(conf: Path) -> dict[str, str]:
    """The choice of each group in config.yaml."""
    listed = yaml.safe_load((conf / "config.yaml").read_text(encoding="utf-8"))["defaults"]
    return {group: name for entry in listed if isinstance(entry, dict) for group, name in entry.items() if isinstance(name, str)}


def _choices(folder: Path, conf: Path) -> Iterator[Choice]:
    """Every file of a folder like conf/."""
    for path in sorted(folder.glob("*.yaml")):
        if path.name not in (*OF_OTHER_COMMANDS, "doctor.yaml"):
            yield Choice("", path.stem, "" if path.stem == "config" else f"{path.stem}.", written_keys(path))
    for group in sorted(path for path in folder.glob("*") if path.is_dir() and path.name != "experiment"):
        for path in sorted(group.glob("*.yaml")):
            yield Choice(group.name, path.stem, f"{group.name}.", tuple(_with_base(path, conf).values()), heading(path))


def _with_base(path: Path, conf: Path) -> dict[str, WrittenKey]:
    """Keys of a choice, and of the choice of its group that it is built on where it has none of its own."""
    keys = dict[str, WrittenKey]()
    for base in bases(path):
        beside, shipped = (folder / f"{base}.yaml" for folder in (path.parent, conf / path.parent.name))
        if found := next((file for file in (beside, shipped) if file.is_file() and file != path), None):
            keys |= _with_base(found, conf)
    for key in written_keys(path):
        under = keys.get(key.key)
        keys[key.key] = replace(key, comment=key.comment or under.comment, owner=under.owner, field=under.field) if under else key
    return keys


class Ranges:
    """Ranges of keys, each as the class declares it that reads the key, be it under another name."""

    def __init__(self, made: Iterable[Choice]) -> None:
        keys = [replace(key, key=f"{choice.prefix}{key.key}") for choice in made for key in choice.keys]
        self._comments = {(key.owner, key.field): key.comment for key in reversed(keys) if key.comment and key.owner}
        passed = ((re.fullmatch(r"\$\{(?:oc\.select:)?([\w.]+)(?:,[^${}]*)?\}", key.value), key) for key in keys)
        self._readers = {found[1]: key for found, key in passed if found and key.owner}

    def of(self, key: WrittenKey) -> Within | None:
        """Return the range of a key, None if it is no number or nobody declares one."""
        reader = key if key.owner else self._readers.get(key.key, key)
        if not reader.owner or key.value.startswith("${"):
            return None
        module, _, name = reader.owner.rpartition(".")
        try:
            made = getattr(importlib.import_module(module), name)
        except (ImportError, AttributeError):  # a class of the user's own, which is not on the path here
            return None
        return declared(made).get(reader.field) if isinstance(made, type) and is_dataclass(made) else None

    def comment(self, key: WrittenKey) -> str:
        """Return what stands beside the same field elsewhere in conf/; empty if nothing does."""
        return self._comments.get((key.owner, key.field), "") if key.owner and key.key.endswith(f".{key.field}") else ""
