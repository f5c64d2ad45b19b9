"""Rows of one kind on their way to the viewer, sent together: a call per row would cost a run a tenth of its time."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np


@dataclass
class ColumnBuffer:
    """Times [ns] and values of rows that were not sent yet."""

    t_ns: list[int] = field(default_factory=list)
    values: list[Any] = field(default_factory=list)

    def add(self, t_ns: int, value: Any) -> None:
        """Take up a row."""
        self.t_ns.append(t_ns)
        self.values.append(value)

    def taken(self) -> tuple[Any, list[Any]]:
        """Return times as numpy durations and values, and forget them."""
        times, values = np.array(self.t_ns, dtype="timedelta64[ns]"), self.values
        self.t_ns, self.values = [], []
        return times, values
