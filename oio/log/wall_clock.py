"""Wall clock of a log: on a bench its stamps begin at the time of day when the world opened, so that a viewer shows both.

A simulated world has no time of day: its stamps begin at 0, and the same seed gives the same bytes. Records always count from 0: the
metadata entry `started` says what to take off.
"""

import functools
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from typing import Any

from oio.core.records import SECOND_NS

STARTED = "started"  # ISO 8601 with its offset from UTC
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def start_ns(metadata: Mapping[str, str]) -> int:
    """Return the nanoseconds from 1970 to when the world of a log opened, 0 without a time of day; raises ValueError for no such time."""
    if STARTED not in metadata:
        return 0
    started = datetime.fromisoformat(metadata[STARTED])
    if started.tzinfo is None:
        raise ValueError(f"{STARTED} is {metadata[STARTED]}, without its offset from UTC")
    return (started - _EPOCH) // timedelta(microseconds=1) * 1000


def shift(message: Any, by_ns: int) -> None:
    """Move all stamps of a message, and of the parts of one with several, by so many nanoseconds."""
    kind: Any = type(message)
    stamps, parts = _fields(kind)
    for name in stamps:
        at = getattr(message, name)
        at.seconds, at.nanos = divmod(at.seconds * SECOND_NS + at.nanos + by_ns, SECOND_NS)
    for name in parts:
        for part in getattr(message, name):
            shift(part, by_ns)


@functools.cache  # a bench makes hundreds of messages a second
def _fields(kind: Any) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the stamps of a class of messages, and of its parts with stamps of their own."""
    names = set(kind.DESCRIPTOR.fields_by_name)
    return tuple(sorted(names & {"stamp", "timestamp"})), tuple(sorted(names & {"entities", "transforms"}))
