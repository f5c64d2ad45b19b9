"""What a nose says on its way to the mailbox: numbers that are none or that never change go no further.

Values at the upper rail are counted and pass, to the log: no stage sees them (`oio.runtime.guarded_world.GuardedWorld`).
"""

import math
from collections import Counter

from hardware.transport.mailbox import Mailbox, StampedSample
from oio.core.records import GasSample


class ReadingFilter:
    """Counts what it lets pass and what it does not."""

    def __init__(self, mailbox: Mailbox, elements: int, highest_raw: float, stuck_after: int) -> None:
        self._mailbox, self._highest, self._stuck_after = mailbox, highest_raw, stuck_after
        self._same = [(math.nan, 0)] * elements  # the last value of each element, and how often it came in a row
        self.counts: Counter[str] = Counter()

    def put(self, t_ns: int, element: int, raw: float, arrived_ns: int) -> None:
        """One value, stamped t_ns, whose last byte was read at arrived_ns [ns of the world]."""
        last, times = self._same[element]
        times = times + 1 if raw == last else 1
        self._same[element] = raw, times
        kind = self._kind(raw, times)
        self.counts[kind] += 1
        if kind in ("samples", "saturated"):
            self._mailbox.put(StampedSample(GasSample(t_ns, element, float(raw)), arrived_ns))

    def none_before(self, t_ns: int) -> None:
        """No value is to come that is stamped before t_ns."""
        self._mailbox.no_gas_before(t_ns)

    def _kind(self, raw: float, times: int) -> str:
        if not math.isfinite(raw):
            return "not a number"
        if raw >= self._highest:
            return "saturated"  # for however long: the gas may be so strong
        return "stuck" if times > self._stuck_after else "samples"
