"""Where device threads leave what came in until the pipeline takes it: bounded, so that a slow reader costs samples, never memory."""

import threading
from collections import deque
from dataclasses import dataclass

from oio.core.records import GasSample, JointState


@dataclass(frozen=True, slots=True)
class StampedSample:
    """A sample, and when its last byte was read [ns of the world]."""

    sample: GasSample | JointState
    at_ns: int


class Mailbox:
    """Two queues, for joints and for gas, and a lock to wait on."""

    def __init__(self, limit: int) -> None:
        self.news = threading.Condition()
        self.joints: deque[StampedSample] = deque()
        self.gas: deque[StampedSample] = deque()
        self.lost = 0  # samples that found their queue full: the oldest goes
        self.gas_ns: int | None = None  # when the nose was heard last
        self.gas_from_ns = 0  # no gas is to come that was sensed before: older joints need not wait for it
        self._limit = limit

    def put(self, arrived: StampedSample) -> None:
        """From any thread."""
        with self.news:
            queue = self.gas if isinstance(arrived.sample, GasSample) else self.joints
            if len(queue) >= self._limit:
                queue.popleft()
                self.lost += 1
            queue.append(arrived)
            if queue is self.gas:
                self.gas_ns = arrived.at_ns
            if queue is self.gas or arrived.sample.t_ns < self.gas_from_ns:  # other joints can wait for the next look
                self.news.notify_all()

    def no_gas_before(self, t_ns: int) -> None:
        """The nose's promise. One that is broken, by a device that began anew, costs a count of late samples."""
        with self.news:
            self.gas_from_ns = max(self.gas_from_ns, t_ns)
            self.news.notify_all()

    def wake(self) -> None:
        """Let a waiting reader look again."""
        with self.news:
            self.news.notify_all()
