"""Plausibility filter between a gas sensor driver and the mailbox: drops values that are not finite, stuck, or codes for `no value`.

Values at the upper rail are counted and passed on to the log; no stage receives them (`oio.runtime.guarded_world.GuardedWorld`).
"""

import math
from collections import Counter
from collections.abc import Callable

from hardware.transport.mailbox import Mailbox, StampedSample
from hardware.transport.port import DeviceLost
from oio.core.records import GasSample

NONE_AT_MOST = 30  # values in a row that mean none; an SCD30 takes a minute for as many


class ReadingFilter:
    """Plausibility filter that counts the values it passes and drops, by reason."""

    def __init__(
        self,
        mailbox: Mailbox,
        elements: int,
        highest_raw: float,
        stuck_after: int,
        is_no_value: Callable[[float], bool] = lambda raw: False,
    ) -> None:
        self._mailbox, self._highest, self._stuck_after = mailbox, highest_raw, stuck_after
        self._is_no_value, self._without = is_no_value, 0  # and number of consecutive values that mean none
        self._repeats = [(math.nan, 0)] * elements  # per element: last value and number of consecutive repetitions
        self.counts: Counter[str] = Counter()

    def put(self, t_ns: int, element: int, raw: float, arrived_ns: int) -> None:
        """Filter one value, stamped t_ns, whose last byte arrived at arrived_ns [ns, world clock].

        Raises DeviceLost for a device that has said nothing but `no value` so often that it will say nothing else.
        """
        last, repeats = self._repeats[element]
        repeats = repeats + 1 if raw == last else 1
        self._repeats[element] = raw, repeats
        kind = self._kind(raw, repeats)
        self.counts[kind] += 1
        self._without = self._without + 1 if kind == "no value" else 0
        if self._without > NONE_AT_MOST:
            raise DeviceLost(
                f"the nose answers, but {self._without} times in a row with {raw:g}, which stands for `no measurement` (sensor.no_value). "
                f"A dead part does so while its temperature and humidity go on: switch it off and on, or replace it."
            )
        if kind in ("samples", "saturated"):
            self._mailbox.put(StampedSample(GasSample(t_ns, element, float(raw)), arrived_ns))

    def none_before(self, t_ns: int) -> None:
        """Declare that no value stamped before t_ns will follow."""
        self._mailbox.no_gas_before(t_ns)

    def _kind(self, raw: float, repeats: int) -> str:
        if not math.isfinite(raw):
            return "not a number"
        if self._is_no_value(raw):
            return "no value"
        if raw >= self._highest:
            return "saturated"  # not stuck, however long it lasts: the concentration may be that high
        return "stuck" if repeats > self._stuck_after else "samples"
