"""A log played as a world: the same stages get the same samples, bit for bit and in the same groups."""

import contextlib
from collections import deque
from collections.abc import Iterator
from pathlib import Path

from oio.core.errors import BadInput, WorldEnded
from oio.core.records import Array, Event, GasSample, JointState, Truth, WorldSample, nanoseconds, seconds
from oio.core.settings import settings
from oio.log import read_end, read_metadata, read_samples
from oio.runtime.guarded_world import move_text

_COMMANDS = ("move", "present")
_SOURCES = ("none", "beacon", "source")


@settings
class Replay:
    """Which log, and what it must have been made with."""

    log: str  # path of a finished log
    sensor: str  # name of the sensor whose YAML reads the raw samples
    dof: int  # joints that moved

    @contextlib.contextmanager
    def open(self) -> Iterator["ReplayedWorld"]:
        """Check the log and stand at its beginning; raises BadInput for no log, a broken one, or one of another sensor or dof."""
        path = Path(self.log).expanduser()
        made_with = read_metadata(path)
        if (made_with.get("sensor"), made_with.get("dof")) != (self.sensor, str(self.dof)):
            was = f"sensor={made_with.get('sensor')} dof={made_with.get('dof')}"
            raise BadInput(f"backend.log={self.log} was made with {was}, but sensor={self.sensor} dof={self.dof} is set. Type {was}.")
        records = read_samples(path)
        with contextlib.closing(records):
            yield ReplayedWorld(self.log, records, read_end(path))


class ReplayedWorld:
    """The live world. A span of samples ends where it ended when it was logged, if the same span is asked for; else by its length."""

    def __init__(self, name: str, records: Iterator[WorldSample], end_ns: int) -> None:
        self._name, self._tape, self._end_ns = name, _Tape(records), end_ns
        self._t_ns, self._last_ns, self._gap_ns = 0, 0, 1
        self._unsaid: list[Event] = []
        self.differing = 0  # commands that are not those of the log

    @property
    def t_ns(self) -> int:
        """Nanoseconds since the logged world opened."""
        return self._t_ns

    def move(self, q_rad: Array, over_s: float) -> float:
        """Nothing moves: the joints are those of the log. If the log has another command here, an Event will say so.

        Returns how long the logged move lasted, so that a filter that asks for other moves stays in step with the log.
        """
        logged = self._compare("move", move_text(q_rad, over_s))
        return over_s if logged is None else float(logged.split(" ", 1)[0])

    def present(self, source: str) -> None:
        """Nothing opens; compared with the log as `move` is. Raises BadInput for what no world has."""
        if source not in _SOURCES:
            raise BadInput(f"present('{source}') was asked for, but a world has {', '.join(_SOURCES)}.")
        self._compare("present", source)

    def samples(self, for_s: float) -> Iterator[WorldSample]:
        """The logged samples and truths of the next `for_s` seconds. Raises WorldEnded when the log does not last that long."""
        until_ns = self._t_ns + nanoseconds(for_s)
        as_logged = self._tape.begins_span(for_s)
        yield from self._said()
        while self._tape.has_more(None if as_logged else until_ns):
            self._pass_over_commands()
            sample = self._tape.take()
            self._pass(sample.t_ns)
            yield sample
        yield from self._said()
        self._end_span(until_ns, as_logged)

    def _pass(self, t_ns: int) -> None:
        if t_ns > self._last_ns:
            self._gap_ns, self._last_ns = t_ns - self._last_ns, t_ns
        self._t_ns = max(self._t_ns, t_ns)

    def _end_span(self, until_ns: int, as_logged: bool) -> None:
        # A world that counts whole ticks stops short of `until_ns`; the log is over only if a further tick would have fit in.
        # Before a first tick nothing is known of ticks; then the log's own mark is to be believed.
        unknown = as_logged and self._last_ns == 0
        if self._tape.head is None and not unknown and self._end_ns + self._gap_ns <= until_ns:
            raise WorldEnded(
                f"backend.log={self._name} ends at {seconds(self._end_ns):.3f} s, but samples until {seconds(until_ns):.3f} s are needed. "
                f"Replay the stages that it was made with, or shorten them."
            )
        self._t_ns = max(self._t_ns, self._tape.next_ns(self._end_ns)) if as_logged else until_ns

    def _compare(self, kind: str, text: str) -> str | None:
        commands = self._tape.commands
        logged = commands.popleft() if commands and commands[0].kind == kind else None
        if logged is None or logged.text != text:
            self._differ(f"'{kind} {text}' was asked for where the log has {f'{kind} {logged.text}' if logged else 'nothing'!r}")
        return logged.text if logged else None

    def _pass_over_commands(self) -> None:
        while self._tape.commands:
            logged = self._tape.commands.popleft()
            self._differ(f"nothing was asked for where the log has '{logged.kind} {logged.text}'")

    def _differ(self, what: str) -> None:
        self.differing += 1
        if self.differing == 1:  # one is enough to know that the rest is not to be compared
            text = f"{what}: from here on the samples are those of the logged path, not of the path asked for"
            self._unsaid.append(Event(self._t_ns, "replay", text))

    def _said(self) -> Iterator[Event]:
        while self._unsaid:
            yield self._unsaid.pop(0)


class _Tape:
    """The log one sample ahead: `head` is the next sample or the mark where a span was asked for, `commands` what stands before it."""

    def __init__(self, records: Iterator[WorldSample]) -> None:
        self._records = records
        self.commands: deque[Event] = deque()
        self.head: WorldSample | None = None
        self._wind()

    def _wind(self) -> None:
        for record in self._records:
            if isinstance(record, Event) and record.kind in _COMMANDS:
                self.commands.append(record)
            elif isinstance(record, JointState | GasSample | Truth) or record.kind == "span":  # other events the new run makes itself
                self.head = record
                return
        self.head = None

    def begins_span(self, for_s: float) -> bool:
        """Whether the log has a span of this length here; its mark is then passed."""
        begins = isinstance(self.head, Event) and float(self.head.text) == for_s
        if begins:
            self._wind()
        return begins

    def has_more(self, until_ns: int | None) -> bool:
        """Whether a sample comes before the next mark, or, if a time is given, until then; marks before it are passed."""
        while until_ns is not None and isinstance(self.head, Event) and self.head.t_ns < until_ns:
            self._wind()
        if self.head is None or isinstance(self.head, Event):
            return False
        return until_ns is None or self.head.t_ns <= until_ns

    def take(self) -> WorldSample:
        """The next sample."""
        assert self.head is not None
        taken = self.head
        self._wind()
        return taken

    def next_ns(self, end_ns: int) -> int:
        """When the run went on after the span before: the time of its next command or span, or the end."""
        after = self.commands[0] if self.commands else self.head
        return end_ns if after is None else after.t_ns
