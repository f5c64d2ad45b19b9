"""A row of the table: one quantity of one element, with its interval, or the sentence that says why there is none."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from oio.core.errors import NotObservable


@dataclass(frozen=True, slots=True)
class Row:
    """One quantity of one element; value and interval are None where `note` says why."""

    element: str
    quantity: str
    value: float | None
    low: float | None
    high: float | None
    unit: str
    note: str = ""


Rows = Iterator[Row]


def identified(element: str, quantity: str, part: Callable[..., Iterable[Row]], *arguments: Any) -> list[Row]:
    """The rows of a part, or one that says why there is none."""
    try:
        return list(part(*arguments))
    except NotObservable as reason:
        return [Row(element, quantity, None, None, None, "", str(reason))]


def about(element: str, quantity: str, value: float, half: float, unit: str, note: str = "") -> Row:
    """A row whose interval is as wide to either side."""
    return Row(element, quantity, value, value - half, value + half, unit, note)
