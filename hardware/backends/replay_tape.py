"""The samples and commands of a log in their order, for a replay."""

from collections import deque
from collections.abc import Iterator

from oio.core.records import Event, GasSample, JointState, Truth, WorldSample
from oio.runtime.guarded_world import GUARD

COMMANDS = ("move", "present")


class ReplayTape:
    """Log reader with one record of look-ahead: `head` is the next sample or span mark, `commands` are the commands before it, `guard` is
    the last account of a guard before it, as text."""

    def __init__(self, records: Iterator[WorldSample]) -> None:
        self._records = records
        self.commands: deque[Event] = deque()
        self.head: WorldSample | None = None
        self.guard: str | None = None
        self._advance()

    def _advance(self) -> None:
        for record in self._records:
            if isinstance(record, Event) and record.kind in COMMANDS:
                self.commands.append(record)
            elif isinstance(record, Event) and record.kind == GUARD:
                self.guard = record.text
            elif isinstance(record, JointState | GasSample | Truth) or record.kind == "span":  # the new run makes other events itself
                self.head = record
                return
        self.head = None

    def begins_span(self, for_s: float) -> bool:
        """Whether a span of this length begins here in the log; its mark is then skipped."""
        is_span = isinstance(self.head, Event) and float(self.head.text) == for_s
        if is_span:
            self._advance()
        return is_span

    def has_more(self, until_ns: int | None) -> bool:
        """Whether a sample comes before the next mark or, if a time is given, until then; marks before it are skipped."""
        while until_ns is not None and isinstance(self.head, Event) and self.head.t_ns < until_ns:
            self._advance()
        if self.head is None or isinstance(self.head, Event):
            return False
        return until_ns is None or self.head.t_ns <= until_ns

    def take(self) -> WorldSample:
        """Return the next sample."""
        assert self.head is not None
        sample = self.head
        self._advance()
        return sample

    def next_ns(self, end_ns: int) -> int:
        """Time at which the run continued after the last span: that of its next command or span, or the end."""
        after = self.commands[0] if self.commands else self.head
        return end_ns if after is None else after.t_ns
