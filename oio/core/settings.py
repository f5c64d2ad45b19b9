"""`@settings`: a frozen, keyword-only, type-checked dataclass whose fields are the configuration schema."""

import dataclasses
import math
import typing
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar, dataclass_transform

from beartype.door import die_if_unbearable
from beartype.roar import BeartypeDoorHintViolation

from oio.core.errors import BadInput

T = TypeVar("T")


@dataclass_transform(frozen_default=True, kw_only_default=True)
def settings(cls: type[T]) -> type[T]:
    """Make `cls` a settings class: every field is required, checked against its annotation, finite, and frozen.

    A class may define `check(self) -> None` for ranges; it raises `BadInput` naming the field. An int is accepted
    where a float is annotated (YAML writes `1` for `1.0`) and converted; a list where a tuple is annotated likewise.
    """
    hints = typing.get_type_hints(cls)
    fields = [name for name, hint in hints.items() if typing.get_origin(hint) is not typing.ClassVar]

    def __post_init__(self: Any) -> None:
        for name in fields:
            object.__setattr__(self, name, _checked(f"{cls.__name__}.{name}", getattr(self, name), hints[name]))
        check: Callable[[], None] | None = getattr(self, "check", None)
        if check is not None:
            check()

    cls.__post_init__ = __post_init__  # type: ignore[attr-defined]
    cls.__deepcopy__ = itself  # type: ignore[attr-defined]
    return dataclasses.dataclass(frozen=True, kw_only=True)(cls)


def itself(frozen: T, memo: object) -> T:
    """`__deepcopy__` of what never changes: a copy of what holds it may share it."""
    return frozen


def _checked(name: str, value: Any, hint: Any) -> Any:
    value = _converted(value, hint)
    _refuse_infinite(name, value)
    try:
        die_if_unbearable(value, hint)
    except BeartypeDoorHintViolation:
        raise BadInput(f"{name} is {value!r}, but its type must be {_words(hint)}.") from None
    return value


def _refuse_infinite(name: str, value: Any) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise BadInput(f"{name} is {value}, but a finite number is needed. Give one, e.g. 1.0.")
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, tuple | list) else ()
    for key, entry in inside:
        _refuse_infinite(f"{name}[{key}]", entry)


def _converted(value: Any, hint: Any) -> Any:
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if float in (hint, *arguments) and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if origin is tuple and isinstance(value, Sequence) and not isinstance(value, str):
        inner = arguments[0] if arguments else Any
        return tuple(_converted(v, inner) for v in value)
    if origin is dict and isinstance(value, Mapping):
        return {k: _converted(v, arguments[1]) for k, v in value.items()}
    if type(None) in arguments and value is not None:
        inner = next(a for a in arguments if a is not type(None))
        return _converted(value, inner)
    return value


def _words(hint: Any) -> str:
    return hint.__name__ if isinstance(hint, type) else str(hint).replace("typing.", "")


def in_range(owner: object, **bounds: tuple[float, float]) -> None:
    """Refuse a field of `owner` outside its closed range, e.g. `in_range(self, dwell_s=(0.1, 60.0))`."""
    for name, (low, high) in bounds.items():
        value = getattr(owner, name)
        if not low <= value <= high:
            raise BadInput(f"{type(owner).__name__}.{name} is {value:g}, but {low:g} to {high:g} is allowed.")
