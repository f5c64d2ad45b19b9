"""Bounded sample queues between the device threads and the pipeline: a slow reader loses samples but never exhausts memory."""

import threading
from collections import deque
from dataclasses import dataclass

from oio.core.records import GasSample, JointState


@dataclass(frozen=True, slots=True)
class StampedSample:
    """A sample with the arrival time of its last byte [ns, world clock]."""

    sample: GasSample | JointState
    at_ns: int


class Mailbox:
    """Two bounded queues, joint states and gas samples, with a condition variable to wait on."""

    def __init__(self, limit: int) -> None:
        self.news = threading.Condition()
        self.joints: deque[StampedSample] = deque()
        self.gas: deque[StampedSample] = deque()
        self.lost = 0  # samples dropped because the queue was full: the oldest is dropped
        self.gas_ns: int | None = None  # arrival time of the last gas sample
        self.gas_from_ns = 0  # no gas sample stamped before this will follow: older joint states need not wait for one
        self._limit = limit

    def put(self, arrived: StampedSample) -> None:
        """Append a sample; callable from any thread."""
        with self.news:
            queue = self.gas if isinstance(arrived.sample, GasSample) else self.joints
            if len(queue) >= self._limit:
                queue.popleft()
                self.lost += 1
            queue.append(arrived)
            if queue is self.gas:
                self.gas_ns = arrived.at_ns
            if queue is self.gas or arrived.sample.t_ns < self.gas_from_ns:  # other joint states wait for the reader's next poll
                self.news.notify_all()

    def no_gas_before(self, t_ns: int) -> None:
        """Declare that no gas sample stamped before t_ns will follow. One that does, after a restart of the device, counts as late."""
        with self.news:
            self.gas_from_ns = max(self.gas_from_ns, t_ns)
            self.news.notify_all()

    def wake(self) -> None:
        """Wake a waiting reader."""
        with self.news:
            self.news.notify_all()
