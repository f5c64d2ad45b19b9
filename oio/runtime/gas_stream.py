"""Gaps in the stream of gas samples: how many samples never came, by the stream's own usual interval."""

from array import array
from dataclasses import dataclass

import numpy as np

from oio.core.records import seconds


@dataclass(frozen=True, slots=True)
class StreamGaps:
    """Samples that were due from the first to the last, those that are missing, and the longest silence [s]."""

    due: int
    missing: int
    longest_s: float


class GasStream:
    """Intervals between gas samples, as they arrive."""

    def __init__(self) -> None:
        self._last_ns: int | None = None
        self._intervals_ns = array("q")

    def arrived(self, t_ns: int) -> None:
        """Take note of a sample."""
        if self._last_ns is not None:
            self._intervals_ns.append(t_ns - self._last_ns)
        self._last_ns = t_ns

    def gaps(self) -> StreamGaps:
        """Count the gaps: an interval of about k times the median lacks k - 1 samples."""
        intervals = np.array(self._intervals_ns)
        if not len(intervals):
            return StreamGaps(0, 0, 0.0)
        missing = int(np.sum(np.maximum(np.rint(intervals / max(float(np.median(intervals)), 1.0)) - 1.0, 0.0)))
        return StreamGaps(len(intervals) + 1 + missing, missing, seconds(int(np.max(intervals))))
