"""Polling schedule of a sensor that must be polled, and the time-out for a sensor that answers without new values."""

import time

from hardware.transport.clock import Clock
from hardware.transport.port import Unplugged
from oio.core.records import nanoseconds, seconds

PERIODS = 5.0  # sampling periods without a new value, after which the measurement counts as stopped
EARLY = 0.7  # fraction of a sampling period without polling after a new value
REST_S = 0.05  # longest sleep, so that the thread can end


class PollSchedule:
    """Polling schedule of one sensor, sampled every sample_s [s], whose value updates every least_s [s] at best."""

    def __init__(self, clock: Clock, sample_s: float, least_s: float) -> None:
        self._clock, self._time_out_ns, self._pause_ns = clock, nanoseconds(PERIODS * max(sample_s, least_s)), nanoseconds(EARLY * sample_s)
        self._last_value_ns, self._due_ns = clock.now_ns(), 0

    def rested(self) -> bool:
        """Sleep briefly if no new value can be ready yet; return whether it slept."""
        wait_s = self._clock.host_s(seconds(self._due_ns - self._clock.now_ns()))
        if wait_s > 0:
            time.sleep(min(wait_s, REST_S))
        return wait_s > 0

    def started(self) -> None:
        """Restart the time-out: the measurement has just been started."""
        self._last_value_ns = self._clock.now_ns()

    def new(self, asked_ns: int) -> None:
        """Record that the request sent at asked_ns returned a new value."""
        self._last_value_ns, self._due_ns = self._clock.now_ns(), asked_ns + self._pause_ns

    def check(self) -> None:
        """Raise Unplugged, so that the port is reopened and the measurement restarted, if there was no new value for too long."""
        if self._clock.now_ns() - self._last_value_ns > self._time_out_ns:
            raise Unplugged("it answers, but measures nothing new")
