"""Clocks of a live bench: the world clock, and the estimate of a device clock's offset and skew against it."""

import time
from collections import deque
from itertools import pairwise

from oio.core.records import SECOND_NS

BLOCK_S = 1.0  # block of the device clock of which only the frame of least delay is kept,
BLOCKS = 128  # and only the latest so many blocks
JUMP_S = 0.5  # a frame that arrives this long before its predicted time means that the device clock was set or restarted
WRAP_MS = 1 << 32
LONG_S = 10.0  # below this length of a hull edge the delay jitter dominates: the skew is not updated
SKEW_MOST = 5e-3  # the frequency of a resonator is within 0.5 %


class Clock:
    """World clock: nanoseconds since the world opened, `speed` times as fast as the host's monotonic clock."""

    def __init__(self, speed: float) -> None:
        self._speed, self._start_ns = speed, time.monotonic_ns()
        self._suspended_at_start_ns = suspended_ns()

    def now_ns(self) -> int:
        """Return the world time [ns]."""
        return int((time.monotonic_ns() - self._start_ns) * self._speed)

    @property
    def suspended_s(self) -> float:
        """Time the host was suspended since the world opened [s]; `now_ns` does not advance during it."""
        return (suspended_ns() - self._suspended_at_start_ns) / SECOND_NS

    def host_s(self, world_s: float) -> float:
        """Convert a duration from world seconds to host seconds."""
        return world_s / self._speed


def suspended_ns() -> int:
    """Time the host was suspended since boot [ns]; 0 where the system does not report it."""
    if not hasattr(time, "CLOCK_BOOTTIME"):
        return 0
    return time.clock_gettime_ns(time.CLOCK_BOOTTIME) - time.clock_gettime_ns(time.CLOCK_MONOTONIC)


class DeviceClock:
    """Conversion of a device's millisecond time stamps to world time [ns], with estimated offset and skew.

    A frame arrives after it was stamped, never before, and sometimes much later: arrival = offset + (1 + skew) device + delay. No delay is
    negative, so the clock is the line below all points (device, arrival - device) that is nearest to them: the edge of their lower convex
    hull that spans the mean of the device times (Moon, Skelly and Towsley 1999). The points are the frames of least delay in each second.
    The offset includes the least delay, which is not observable separately (`nominal.delay_s`).
    """

    def __init__(self) -> None:
        self.jumps = 0
        self._reset()
        self._last_ns = -1

    def _reset(self) -> None:
        self._points: deque[tuple[float, float]] = deque(maxlen=BLOCKS)  # (device s, arrival - device s) of least delay per block
        self._wraps, self._last_ms = 0, -1.0
        self.skew, self._offset_s, self._outdated = 0.0, 0.0, False

    def to_world_ns(self, device_ms: float, arrived_ns: int) -> int:
        """Convert a frame's device time stamp [ms] to world time [ns]: later than the previous one, not later than its arrival.

        A frame that is above the line is converted first; what it changes of the line is computed by `settle`, or before the next one.
        """
        self.settle()
        if self._last_ms - device_ms > WRAP_MS // 2:
            self._wraps += 1
        device_s = self._device_s(device_ms)
        # a frame can have any delay, but never a negative one, and no device clock runs backwards
        early = bool(self._points) and arrived_ns / SECOND_NS - device_s < self._fitted_offset_s(device_s) - JUMP_S
        if early or (device_ms < self._last_ms and self._last_ms - device_ms <= WRAP_MS // 2):
            self.jumps += 1
            self._reset()
            device_s = self._device_s(device_ms)
        self._last_ms = device_ms
        self._add_point(device_s, arrived_ns / SECOND_NS - device_s)
        at_ns = round((device_s + self._fitted_offset_s(device_s)) * SECOND_NS)
        self._last_ns = max(min(at_ns, arrived_ns), self._last_ns + 1)
        return self._last_ns

    def settle(self) -> None:
        """Fit the line to the frames so far, which takes 0.1 ms: when nobody waits for it."""
        if self._outdated:
            self._fit()

    def _device_s(self, device_ms: float) -> float:
        return 1e-3 * (device_ms + self._wraps * WRAP_MS)

    def _fitted_offset_s(self, device_s: float) -> float:
        return self._offset_s + self.skew * device_s

    def _add_point(self, device_s: float, offset_s: float) -> None:
        self._outdated = True
        new_block = not self._points or int(self._points[-1][0] / BLOCK_S) != int(device_s / BLOCK_S)
        if new_block:
            self._points.append((device_s, offset_s))
        elif offset_s < self._points[-1][1]:
            self._points[-1] = device_s, offset_s
        elif offset_s >= self._fitted_offset_s(device_s):
            self._outdated = False
        if self._outdated and (len(self._points) == 1 or offset_s < self._fitted_offset_s(device_s)):
            self._fit()

    def _fit(self) -> None:
        self._outdated = False
        hull = _lower_hull(list(self._points))
        middle = sum(d for d, _ in self._points) / len(self._points)
        a, b = next(((a, b) for a, b in pairwise(hull) if b[0] >= middle), (hull[0], hull[0]))
        if b[0] - a[0] >= LONG_S:
            self.skew = min(max((b[1] - a[1]) / (b[0] - a[0]), -SKEW_MOST), SKEW_MOST)
        self._offset_s = min(offset - self.skew * device for device, offset in self._points)


def _lower_hull(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Lower convex hull of points sorted by their first coordinate (Andrew 1979)."""
    hull: list[tuple[float, float]] = []
    for p in points:
        while len(hull) >= 2 and _cross(hull[-2], hull[-1], p) <= 0:
            hull.pop()
        hull.append(p)
    return hull


def _cross(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    """Cross product of a->b and a->c; positive for a left turn."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
