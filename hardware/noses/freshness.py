"""How long a sensor that answers may have nothing new to say: then it measures no more, and must be started again."""

from hardware.links.clock import Clock
from hardware.links.port import Unplugged
from oio.records import nanoseconds

PERIODS, LEAST_S = 5.0, 3.0  # so many sampling periods, but so long at least


class Freshness:
    """Of one sensor that is asked again and again."""

    def __init__(self, clock: Clock, sample_s: float) -> None:
        self._clock, self._most_ns, self._new_ns = clock, nanoseconds(max(PERIODS * sample_s, LEAST_S)), clock.now_ns()

    def renew(self) -> None:
        """It was started, or said something new."""
        self._new_ns = self._clock.now_ns()

    def check(self) -> None:
        """Raises Unplugged, so that its port is opened anew and it is started, if it has been stale for too long."""
        if self._clock.now_ns() - self._new_ns > self._most_ns:
            raise Unplugged("it answers, but measures nothing new")
