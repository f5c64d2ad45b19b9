"""Reordering of a live bench's samples: joint states wait for older gas samples, which take longer to arrive."""

from collections import deque
from collections.abc import Callable

from hardware.transport.clock import Clock
from hardware.transport.mailbox import Mailbox, StampedSample
from oio.core.records import nanoseconds


class ReorderBuffer:
    """The mailbox's two queues, gas and joints, as one in time order; `delay_s`: how long a joint state waits for an older gas sample."""

    def __init__(self, mailbox: Mailbox, clock: Clock, delay_s: float, look_s: float) -> None:
        self._mailbox, self._clock, self.delay_s, self._look_s = mailbox, clock, delay_s, look_s
        self.delay_ns = nanoseconds(delay_s)

    def next(self, until_ns: int, check: Callable[[], None]) -> StampedSample | None:
        """The next sample up to until_ns, once no earlier one can arrive; None at the end. `check` is called at least every look_s."""
        while True:
            check()
            with self._mailbox.news:
                now_ns = self._clock.now_ns()
                queue, due_ns = self._earliest_queue()
                in_span = bool(queue) and queue[0].sample.t_ns <= until_ns
                if in_span and due_ns <= now_ns:
                    return queue.popleft()
                end_ns = until_ns + self.delay_ns
                if not in_span and now_ns >= end_ns:
                    return None
                wake_ns = min(due_ns, end_ns) if in_span else end_ns
                self._mailbox.news.wait(min(max(self._clock.host_s(1e-9 * (wake_ns - now_ns)), 0.0), self._look_s))

    def _earliest_queue(self) -> tuple[deque[StampedSample], int]:
        """Return the queue with the earliest head and its release time [ns]: gas at once, joints when no older gas can arrive."""
        gas, joints = self._mailbox.gas, self._mailbox.joints
        if gas and (not joints or gas[0].sample.t_ns <= joints[0].sample.t_ns):
            return gas, 0
        is_final = gas or not joints or joints[0].sample.t_ns < self._mailbox.gas_from_ns
        return joints, 0 if is_final else joints[0].sample.t_ns + self.delay_ns
