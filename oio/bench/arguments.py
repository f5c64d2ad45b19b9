"""Command-line arguments of a benchmark, KEY=VALUE: its own keys (see conf/bench.yaml), and overrides for the configuration of trials."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import yaml

from oio.core.errors import BadInput
from oio.core.folders import CONF

SOURCE = CONF / "bench.yaml"


@dataclass(frozen=True)
class Arguments:
    """Parsed arguments over the defaults; values stay text until they are read."""

    command: str
    own: Mapping[str, str]
    overrides: tuple[str, ...]

    def several(self, key: str) -> tuple[str, ...]:
        """Return the entries of a list such as `ndir,ec`."""
        entries = tuple(self.own[key].split(","))
        if "" in entries or len(set(entries)) < len(entries):
            raise self._refusal(key, f"{key} is a list of different entries")
        return entries

    def whole(self, key: str, least: int = 0) -> int:
        """Return a whole number."""
        return self._whole(key, self.own[key], least)

    def yes(self, key: str) -> bool:
        """Return whether it is true."""
        if self.own[key] not in ("true", "false"):
            raise self._refusal(key, f"{key} is true or false")
        return self.own[key] == "true"

    def number(self, key: str) -> float:
        """Return a number above zero."""
        try:
            value = float(self.own[key])
        except ValueError:
            value = -1.0
        if not 0.0 < value < float("inf"):
            raise self._refusal(key, f"{key} is a number above 0")
        return value

    def wholes(self, key: str) -> tuple[int, ...]:
        """Return whole numbers: a list, or a range `from:until` without its end."""
        first, colon, end = self.own[key].partition(":")
        if not colon:
            return tuple(self._whole(key, entry, 0) for entry in self.several(key))
        found = tuple(range(self._whole(key, first, 0), self._whole(key, end, 0)))
        if not found:
            raise self._refusal(key, "that is an empty range")
        return found

    def _whole(self, key: str, text: str, least: int) -> int:
        if not text.isascii() or not text.isdigit() or int(text) < least:
            raise self._refusal(key, f"'{text}' is not a whole number, {least} or more")
        return int(text)

    def _refusal(self, key: str, why: str) -> BadInput:
        return BadInput(f"{key}={self.own[key]} was given, but {why}. Type e.g. {key}={defaults(self.command)[key]}.")


def read(command: str, arguments: list[str]) -> Arguments:
    """Parse the arguments of a command; raises BadInput for anything but KEY=VALUE, and for a key given twice."""
    own, overrides, seen = defaults(command), list[str](), set[str]()
    for word in arguments:
        key, equals, value = word.partition("=")
        if not equals or not key or key.startswith("-"):
            raise BadInput(f"'{word}' was given, but a benchmark takes KEY=VALUE words; --help lists them. Type e.g. {_example(command)}.")
        if key in seen:
            raise BadInput(f"{key} was given twice. Give it once, e.g. {_example(command)}.")
        if key == "seed":
            raise BadInput(f"{word} was given, but a benchmark takes many. Type e.g. seeds={value}, seeds=5000:5020 or seeds=3,5.")
        seen.add(key)
        if key in own:
            own[key] = value
        else:
            overrides.append(word)
    return Arguments(command, own, tuple(overrides))


def defaults(command: str) -> dict[str, str]:
    """Return the keys of a command as text, from conf/bench.yaml."""
    found: dict[str, Any] = yaml.safe_load(SOURCE.read_text(encoding="utf-8"))[command]
    return {key: _text(value) for key, value in found.items()}


def _text(value: Any) -> str:
    return "null" if value is None else str(value).lower() if isinstance(value, bool) else str(value)


def _example(command: str) -> str:
    return f"python -m oio.bench {command} seeds=0:2"
