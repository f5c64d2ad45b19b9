"""When a sensor that has to be asked is asked, and how long it may have nothing new to say."""

import time

from hardware.transport.clock import Clock
from hardware.transport.port import Unplugged
from oio.core.records import nanoseconds, seconds

PERIODS = 5.0  # of sampling, without anything new: then it measures no more
EARLY = 0.7  # of a sampling period after something new the wire is left alone
REST_S = 0.05  # at a time, so that the thread can end


class PollSchedule:
    """Of one sensor, that is to be sampled every sample_s and gives something new every least_s at best."""

    def __init__(self, clock: Clock, sample_s: float, least_s: float) -> None:
        self._clock, self._most_ns, self._early_ns = clock, nanoseconds(PERIODS * max(sample_s, least_s)), nanoseconds(EARLY * sample_s)
        self._new_ns, self._due_ns = clock.now_ns(), 0

    def rested(self) -> bool:
        """Whether nothing can be new yet; it has then rested for a moment."""
        wait_s = self._clock.host_s(seconds(self._due_ns - self._clock.now_ns()))
        if wait_s > 0:
            time.sleep(min(wait_s, REST_S))
        return wait_s > 0

    def started(self) -> None:
        """It measures from now on."""
        self._new_ns = self._clock.now_ns()

    def new(self, asked_ns: int) -> None:
        """It had something new when it was asked."""
        self._new_ns, self._due_ns = self._clock.now_ns(), asked_ns + self._early_ns

    def check(self) -> None:
        """Raises Unplugged, so that its port is opened anew and it is started, if it had nothing new for too long."""
        if self._clock.now_ns() - self._new_ns > self._most_ns:
            raise Unplugged("it answers, but measures nothing new")
