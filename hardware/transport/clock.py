"""Time on a real bench: the world's clock, and a device's own milliseconds as that clock saw them."""

import time
from collections import deque
from itertools import pairwise

from oio.core.records import SECOND_NS

BLOCK_S = 1.0  # of each such stretch of the device's clock the quickest frame is kept,
BLOCKS = 128  # the latest so many
JUMP_S = 0.5  # a frame that is so early comes from a clock that was set or began again
WRAP_MS = 1 << 32
LONG_S = 10.0  # a shorter edge tells more of delays than of the clock: the skew stays as it was
SKEW_MOST = 5e-3  # a resonator is within 0.5 %


class Clock:
    """Nanoseconds since the world opened, `speed` times as fast as the host's monotonic clock."""

    def __init__(self, speed: float) -> None:
        self._speed, self._began_ns = speed, time.monotonic_ns()
        self._slept_ns = suspended_ns()

    def now_ns(self) -> int:
        """Of the world."""
        return int((time.monotonic_ns() - self._began_ns) * self._speed)

    @property
    def slept_s(self) -> float:
        """How long the host was suspended meanwhile: for `now_ns` no time passed then."""
        return (suspended_ns() - self._slept_ns) / SECOND_NS

    def host_s(self, world_s: float) -> float:
        """Seconds of the host that so many of the world take."""
        return world_s / self._speed


def suspended_ns() -> int:
    """Since boot; 0 where the system does not tell."""
    if not hasattr(time, "CLOCK_BOOTTIME"):
        return 0
    return time.clock_gettime_ns(time.CLOCK_BOOTTIME) - time.clock_gettime_ns(time.CLOCK_MONOTONIC)


class DeviceClock:
    """A device's milliseconds as nanoseconds of the world.

    A frame comes in after it was stamped, never before, and sometimes much later: arrival = offset + (1 + skew) device + delay. No delay is
    negative, so the line under all points (device, arrival - device) that is nearest to them is the clock: the edge of their lower convex
    hull that spans the mean of the device's times (Moon, Skelly and Towsley 1999). Points are the quickest frames of each second. The
    offset includes the least delay, which cannot be told from it (`nominal.delay_s`).
    """

    def __init__(self) -> None:
        self.jumps = 0
        self._began()
        self._last_ns = -1

    def _began(self) -> None:
        self._points: deque[tuple[float, float]] = deque(maxlen=BLOCKS)  # device s, arrival - device s; the quickest of a block
        self._wraps, self._last_ms = 0, -1
        self.skew, self._offset_s = 0.0, 0.0

    def stamped(self, device_ms: int, arrived_ns: int) -> int:
        """When a frame was stamped, in nanoseconds of the world: after the one before, not after it arrived."""
        if self._last_ms - device_ms > WRAP_MS // 2:
            self._wraps += 1
        device_s = self._device_s(device_ms)
        # a frame may be late by anything, but it is never early, and no clock runs backwards
        early = bool(self._points) and arrived_ns / SECOND_NS - device_s < self._line(device_s) - JUMP_S
        if early or (device_ms < self._last_ms and self._last_ms - device_ms <= WRAP_MS // 2):
            self.jumps += 1
            self._began()
            device_s = self._device_s(device_ms)
        self._last_ms = device_ms
        self._add(device_s, arrived_ns / SECOND_NS - device_s)
        at_ns = round((device_s + self._line(device_s)) * SECOND_NS)
        self._last_ns = max(min(at_ns, arrived_ns), self._last_ns + 1)
        return self._last_ns

    def _device_s(self, device_ms: int) -> float:
        return 1e-3 * (device_ms + self._wraps * WRAP_MS)

    def _line(self, device_s: float) -> float:
        return self._offset_s + self.skew * device_s

    def _add(self, device_s: float, late_s: float) -> None:
        new_block = not self._points or int(self._points[-1][0] / BLOCK_S) != int(device_s / BLOCK_S)
        if new_block:
            self._points.append((device_s, late_s))
        elif late_s < self._points[-1][1]:
            self._points[-1] = device_s, late_s
        elif late_s >= self._line(device_s):
            return
        self._fit()

    def _fit(self) -> None:
        hull = _lower_hull(list(self._points))
        middle = sum(d for d, _ in self._points) / len(self._points)
        a, b = next(((a, b) for a, b in pairwise(hull) if b[0] >= middle), (hull[0], hull[0]))
        if b[0] - a[0] >= LONG_S:
            self.skew = min(max((b[1] - a[1]) / (b[0] - a[0]), -SKEW_MOST), SKEW_MOST)
        self._offset_s = min(late - self.skew * device for device, late in self._points)


def _lower_hull(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Of points in the order of their first number (Andrew 1979)."""
    hull: list[tuple[float, float]] = []
    for p in points:
        while len(hull) >= 2 and _turn(hull[-2], hull[-1], p) <= 0:
            hull.pop()
        hull.append(p)
    return hull


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
