"""What a nose says on its way to the mailbox: numbers that are none, that never change, or that stand at the upper rail go no further."""

import math
from collections import Counter

from hardware.links.mailbox import Arrived, Mailbox
from oio.records import GasSample


class Intake:
    """Counts what it lets pass and what it does not."""

    def __init__(self, mailbox: Mailbox, elements: int, full: float, stuck_after: int) -> None:
        self._mailbox, self._full, self._stuck_after = mailbox, full, stuck_after
        self._same = [(math.nan, 0)] * elements  # the last value of each element, and how often it came in a row
        self.counts: Counter[str] = Counter()

    def put(self, t_ns: int, element: int, raw: float, arrived_ns: int) -> None:
        """One value, stamped t_ns, whose last byte was read at arrived_ns [ns of the world]."""
        last, times = self._same[element]
        times = times + 1 if raw == last else 1
        self._same[element] = raw, times
        why = (
            "not a number" if not math.isfinite(raw) else "saturated" if raw >= self._full else "stuck" if times > self._stuck_after else ""
        )
        self.counts[why or "samples"] += 1
        if not why:
            self._mailbox.put(Arrived(GasSample(t_ns, element, float(raw)), arrived_ns))
