"""`@settings`: a frozen, keyword-only, type-checked dataclass whose fields are the configuration schema."""

import dataclasses
import math
import operator
import typing
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar, dataclass_transform

from beartype.door import die_if_unbearable
from beartype.roar import BeartypeDoorHintViolation

from oio.core.errors import BadInput
from oio.core.ranges import Within as Within
from oio.core.ranges import refuse_outside, within
from oio.core.type_words import words

T = TypeVar("T")


@dataclass_transform(frozen_default=True, kw_only_default=True)
def settings(cls: type[T]) -> type[T]:
    """Make `cls` a settings class: every field is required, checked against its annotation and range, finite, and frozen.

    A range is declared in the annotation: `Annotated[float, Within(0.1, 60)]`; of a tuple or a mapping it is that of every number
    inside. A class may define `check(self) -> None` for what a range cannot say; it raises `BadInput` naming the field. An int is
    accepted where a float is annotated (YAML writes `1` for `1.0`) and converted; a list where a tuple is annotated likewise.
    """
    hints, extras = typing.get_type_hints(cls), typing.get_type_hints(cls, include_extras=True)
    fields = [name for name, hint in hints.items() if typing.get_origin(hint) is not typing.ClassVar]
    ranges = {name: allowed for name in fields if (allowed := within(extras[name])) is not None}

    def __post_init__(self: Any) -> None:
        for name in fields:
            key = f"{cls.__name__}.{name}"
            value = _checked(key, getattr(self, name), hints[name])
            if name in ranges:
                refuse_outside(key, value, ranges[name])
            object.__setattr__(self, name, value)
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
        raise BadInput(f"{name} is {_yaml(value)}, but it must be {words(hint)}.") from None
    return value


def _yaml(value: Any) -> str:
    """A value as one types it, but a text in quotes; at most about a line of it."""
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(_yaml, value))}]"[:100]
    return "null" if value is None else str(value).lower() if isinstance(value, bool) else repr(value)[:100]


def _refuse_infinite(name: str, value: Any) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise BadInput(f"{name} is {value}, but a finite number is needed.")
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, tuple | list) else ()
    for key, entry in inside:
        _refuse_infinite(f"{name}[{key}]" if isinstance(value, tuple | list) else f"{name}.{key}", entry)


def _converted(value: Any, hint: Any) -> Any:
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if float in (hint, *arguments) and isinstance(value, int) and not isinstance(value, bool):
        return float(value) if abs(value) < 10**300 else math.inf
    if origin is tuple and isinstance(value, Sequence) and not isinstance(value, str):
        inner = arguments[0] if arguments else Any
        return tuple(_converted(v, inner) for v in value)
    if origin is dict and isinstance(value, Mapping):
        return {k: _converted(v, arguments[1]) for k, v in value.items()}
    if type(None) in arguments and value is not None:
        inner = next(a for a in arguments if a is not type(None))
        return _converted(value, inner)
    return value


def refuse_below(owner: object, name: str, least: str) -> None:
    """Refuse a field of `owner` that is less than another one, e.g. `refuse_below(self, "step", "min_step")`; dots go deeper."""
    value, low = operator.attrgetter(name, least)(owner)
    if value < low:
        raise BadInput(f"{type(owner).__name__}.{name} is {value:g}, but it must be at least {least}, which is {low:g}.")
