"""Shared by all conformance tests: assertion with a message, frozen dataclasses, and bitwise comparison of records."""

import dataclasses
from typing import Any

import numpy as np

from oio.core.errors import BadInput


def require(holds: bool, sentence: str) -> None:
    """Raise AssertionError with the sentence unless it holds; works under `python -O` as well, where `assert` does not."""
    if not holds:
        raise AssertionError(sentence)


def require_frozen(thing: object) -> None:
    """Check that `thing`, which Hydra builds, is a frozen dataclass, such as `@settings` makes."""
    name = type(thing).__name__
    require(dataclasses.is_dataclass(thing), f"{name} is no dataclass; put @settings above it.")
    parameters: Any = getattr(type(thing), "__dataclass_params__", None)
    require(parameters is not None and parameters.frozen, f"{name} can be changed after it was built; put @settings above it.")


def require_bad_input(what: str, action: Any, *arguments: Any) -> None:
    """Check that the action raises BadInput with a message."""
    try:
        action(*arguments)
    except BadInput as error:
        require(len(str(error)) > 10, f"{what} is refused, but without saying why.")
        return
    raise AssertionError(f"{what} is not refused with BadInput.")


def bitwise(value: object) -> object:
    """Return type and values of a record and of nested ones, floats and arrays as bytes, so that equal means equal bit for bit."""
    if dataclasses.is_dataclass(value):
        return [type(value), *(bitwise(getattr(value, field.name)) for field in dataclasses.fields(value))]
    if isinstance(value, tuple):
        return [bitwise(part) for part in value]
    return np.asarray(value, dtype=float).tobytes() if isinstance(value, float | np.ndarray) else value
