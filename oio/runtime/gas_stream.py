"""Gaps in the stream of gas samples: how many never came, by the stream's own usual interval, and whether it ends with the joints'."""

from array import array
from dataclasses import dataclass

import numpy as np

from oio.core.records import SECOND_NS, seconds


@dataclass(frozen=True, slots=True)
class StreamGaps:
    """Samples that were due from the first to the last, those that are missing, the longest silence and the usual interval [s], and by
    how much the stream of joint states goes on after the last gas sample [s], negative if it ends before."""

    due: int
    missing: int
    longest_s: float
    interval_s: float
    joints_after_s: float


class GasStream:
    """Intervals between gas samples, as they arrive, and the last joint state."""

    def __init__(self) -> None:
        self._last_ns: int | None = None
        self._last_joints_ns: int | None = None
        self._intervals_ns = array("q")

    def joints_arrived(self, t_ns: int) -> None:
        """Take note of a joint state."""
        self._last_joints_ns = t_ns

    def arrived(self, t_ns: int) -> None:
        """Take note of a sample."""
        if self._last_ns is not None and t_ns > self._last_ns:  # two elements may be sampled at once
            self._intervals_ns.append(t_ns - self._last_ns)
        self._last_ns = t_ns

    def gaps(self) -> StreamGaps:
        """Count the gaps: an interval of about k times the median lacks k - 1 samples."""
        intervals = np.array(self._intervals_ns)
        if not len(intervals):
            return StreamGaps(0, 0, 0.0, 0.0, self._joints_after_s)
        usual_ns = float(np.median(intervals))
        missing = int(np.sum(np.maximum(np.rint(intervals / max(usual_ns, 1.0)) - 1.0, 0.0)))
        longest_s = seconds(int(np.max(intervals)))
        return StreamGaps(len(intervals) + 1 + missing, missing, longest_s, usual_ns / SECOND_NS, self._joints_after_s)

    @property
    def _joints_after_s(self) -> float:
        if self._last_ns is None or self._last_joints_ns is None:
            return 0.0
        return seconds(self._last_joints_ns - self._last_ns)
