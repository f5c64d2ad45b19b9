"""A type in plain words, for a message: `tuple[float, float, float] | None` is `three numbers or null`."""

import types
import typing
from typing import Any

PLAIN: dict[Any, tuple[str, str]] = {  # one, several
    float: ("a number", "numbers"),
    int: ("a whole number", "whole numbers"),
    str: ("a text", "texts"),
    bool: ("true or false", "true or false"),
    type(None): ("null", "null"),
}
COUNTS = {1: "one", 2: "two", 3: "three", 4: "four", 5: "five", 6: "six"}


def words(hint: Any) -> str:
    """Return what a value of this type is, e.g. `a number` or `a list of texts`."""
    return _words(hint, 0)


def _words(hint: Any, several: int) -> str:
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if hint in PLAIN:
        return PLAIN[hint][several]
    if origin in (typing.Union, types.UnionType):
        return " or ".join(_words(each, several) for each in inner)
    if origin is tuple and inner[-1] is Ellipsis:
        return f"{('a list', 'lists')[several]} of {_words(inner[0], 1)}"
    if origin is tuple:
        alike = len(set(inner)) == 1
        listed = f"{COUNTS.get(len(inner), len(inner))} {_words(inner[0], 1)}" if alike else " and ".join(_words(i, 0) for i in inner)
        return f"lists of {listed}" if several else listed
    if origin is dict:
        return f"{_words(inner[1], 0)} for each {'number' if inner[0] is int else 'name'}"
    return f"a {hint.__name__}, with keys of its own" if isinstance(hint, type) else str(hint).replace("typing.", "")
