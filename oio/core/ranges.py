"""Ranges of numbers, declared once at the field, `dwell_s: Annotated[float, Within(0.1, 60)]`; check, help and docs read them there."""

import dataclasses
import typing
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from oio.core.errors import BadInput


@dataclass(frozen=True, slots=True)
class Within:
    """Closed range of a number, or of every number in a tuple or mapping."""

    low: float
    high: float
    told: str = ""  # of the number, if its name does not tell enough

    def __str__(self) -> str:
        return f"{self.low:g} to {self.high:g}"

    def __contains__(self, number: float) -> bool:
        return self.low <= number <= self.high


def declared(cls: type) -> dict[str, Within | None]:
    """Return the range of every field of a settings class that holds numbers, by its name; None where no range is declared.

    A field holds numbers if float or int is in its annotation; a ClassVar is no field.
    """
    hints = typing.get_type_hints(cls, include_extras=True)
    names = (field.name for field in dataclasses.fields(cls) if holds_numbers(hints[field.name]))
    return {name: within(hints[name]) for name in names}


def within(hint: Any) -> Within | None:
    """Return the range in an annotation, if it has one."""
    return next((extra for extra in getattr(hint, "__metadata__", ()) if isinstance(extra, Within)), None)


def holds_numbers(hint: Any) -> bool:
    """Whether float or int is in an annotation, at any depth; an array is none."""
    return hint in (float, int) or (typing.get_origin(hint) is not None and any(map(holds_numbers, typing.get_args(hint))))


def refuse_outside(name: str, value: Any, allowed: Within) -> None:
    """Raise BadInput for the first number of `value` that is out of range."""
    for place, number in _numbers(value):
        if number not in allowed:
            raise BadInput(
                f"{name}{place} is {_shown(number)}, but {allowed} is allowed{f': it is the {allowed.told}' if allowed.told else ''}."
            )


def _shown(number: float) -> str:
    return str(number)[:40] if isinstance(number, int) else f"{number:g}"


def _numbers(value: Any) -> Iterator[tuple[str, float]]:
    """Numbers with their place: `[1]` in a tuple, `.x` in a mapping."""
    if isinstance(value, float | int) and not isinstance(value, bool):
        yield "", value
    inside = [(f".{k}", v) for k, v in value.items()] if isinstance(value, Mapping) else []
    inside += [(f"[{i}]", v) for i, v in enumerate(value)] if isinstance(value, tuple | list) else []
    for place, inner in inside:
        yield from ((f"{place}{deeper}", number) for deeper, number in _numbers(inner))
