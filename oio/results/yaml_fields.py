"""Fields of a file from outside, read strictly: every value is checked for its kind, and a refusal names its full key."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import yaml

from oio.core.errors import BadInput
from oio.core.records import Array

SAFE: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # plain data only; in C, where there is one, ten times as fast


def plain_yaml(text: str, name: str, example: str) -> object:
    """Return a file's text as plain data; nothing in it is built. Raises BadInput for what is no YAML, and for aliases: a few lines of
    them can stand for more than any memory holds. `example` says what to give instead."""
    try:
        aliased = any(isinstance(event, yaml.AliasEvent) for event in yaml.parse(text, Loader=SAFE))
        document: object = None if aliased else yaml.load(text, Loader=SAFE)
    except (yaml.YAMLError, RecursionError, ValueError) as error:  # ValueError: a date that is none
        raise BadInput(f"{name} is no plain YAML: {' '.join(str(error).split())}. {example}") from None
    if aliased:
        raise BadInput(f"{name} has aliases (*), which no such file has. {example}")
    return document


class Fields:
    """A mapping of a file, with the dotted key at which it stands."""

    def __init__(self, values: object, file: str, key: str = "") -> None:
        self._file, self._key = file, key
        if not isinstance(values, Mapping):
            raise self._wrong(key or "the whole file", values, "a mapping of keys to values")
        self._values: Mapping[Any, Any] = values

    @property
    def names(self) -> tuple[str, ...]:
        """Keys of this mapping, as text."""
        return tuple(map(str, self._values))

    def section(self, name: str) -> "Fields":
        """Return a mapping below."""
        return Fields(self._value(name), self._file, self._path(name))

    def sections(self, name: str) -> list["Fields"]:
        """Return a list of mappings below."""
        values = self._list(name)
        return [Fields(value, self._file, f"{self._path(name)}[{i}]") for i, value in enumerate(values)]

    def text(self, name: str) -> str:
        """Return a text."""
        value = self._value(name)
        if not isinstance(value, str):
            raise self._wrong(self._path(name), value, "a text")
        return value

    def maybe_text(self, name: str) -> str | None:
        """Return a text, or None where there is null or no such key."""
        return self.text(name) if self._values.get(name) is not None else None

    def texts(self, name: str) -> tuple[str, ...]:
        """Return a list of texts."""
        values = self._list(name)
        if not all(isinstance(value, str) for value in values):
            raise self._wrong(self._path(name), values, "a list of texts")
        return tuple(values)

    def number(self, name: str, low: float = -math.inf) -> float:
        """Return a finite number, at least `low`."""
        value = self._value(name)
        if not _is_number(value) or value < low:
            raise self._wrong(self._path(name), value, "a finite number" + ("" if low == -math.inf else f", {low:g} or more"))
        return float(value)

    def maybe_number(self, name: str, low: float = -math.inf) -> float | None:
        """Return a finite number or null."""
        return None if self._value(name) is None else self.number(name, low)

    def whole(self, name: str, low: int = 0) -> int:
        """Return a whole number, at least `low`."""
        value = self._value(name)
        if not isinstance(value, int) or isinstance(value, bool) or value < low:
            raise self._wrong(self._path(name), value, f"a whole number, {low} or more")
        return value

    def numbers(self, name: str, n: int) -> Array:
        """Return n finite numbers (n,)."""
        values = self._list(name)
        if len(values) != n or not all(map(_is_number, values)):
            raise self._wrong(self._path(name), values, f"{n} finite numbers")
        return np.array(values, dtype=float)

    def covariance(self, name: str, n: int) -> Array:
        """Return a covariance (n, n): finite, symmetric, no negative variance."""
        rows = self._list(name)
        if len(rows) != n or not all(isinstance(row, list) and len(row) == n and all(map(_is_number, row)) for row in rows):
            raise self._wrong(self._path(name), rows, f"{n} rows of {n} finite numbers")
        cov = np.array(rows, dtype=float)
        sd = np.sqrt(np.maximum(np.diag(cov), 1e-300))
        scaled = cov / np.outer(sd, sd)  # parameters of very different units
        if not np.array_equal(cov, cov.T) or np.any(np.diag(cov) <= 0.0) or np.linalg.eigvalsh(scaled)[0] < -1e-9:
            raise self._wrong(self._path(name), "not a covariance", "a symmetric matrix without negative variances")
        return cov

    def _list(self, name: str) -> list[Any]:
        values = self._value(name)
        if not isinstance(values, list):
            raise self._wrong(self._path(name), values, "a list")
        return values

    def _value(self, name: str) -> Any:
        if name not in self._values:
            raise BadInput(f"{self._file} has no key '{self._path(name)}'. It was written by another version, or changed by hand.")
        return self._values[name]

    def _path(self, name: str) -> str:
        return f"{self._key}.{name}" if self._key else name

    def _wrong(self, key: str, given: object, allowed: str) -> BadInput:
        text = repr(given)
        return BadInput(f"{self._file}: {key} is {text if len(text) < 60 else text[:60] + ' ...'}, but it must be {allowed}.")


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
