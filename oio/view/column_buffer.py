"""Rows of one kind on their way to the viewer, sent together: a call per row would cost a run a tenth of its time."""

from dataclasses import dataclass, field
from typing import Any


@dataclass
class ColumnBuffer:
    """Times [ns] and values of rows that were not sent yet."""

    t_ns: list[int] = field(default_factory=list)
    values: list[Any] = field(default_factory=list)

    def add(self, t_ns: int, value: Any) -> None:
        """Take up a row."""
        self.t_ns.append(t_ns)
        self.values.append(value)

    def taken(self) -> tuple[list[int], list[Any]]:
        """Return times and values, and forget them."""
        times, values = self.t_ns, self.values
        self.t_ns, self.values = [], []
        return times, values
