"""World of a replayed log: the same stages get the same samples, bit for bit and in the same groups."""

import contextlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Annotated

from hardware.backends.replay_tape import ReplayTape
from oio.core.errors import BadInput, WorldEnded
from oio.core.records import Array, Event, WorldSample, nanoseconds, seconds
from oio.core.settings import Within, settings
from oio.log import read_end, read_metadata, read_samples
from oio.motion.guard_account import GuardAccount
from oio.runtime.guarded_world import move_text

_SOURCES = ("none", "beacon", "source")


@settings
class Replay:
    """Configuration: the log, and the sensor and DoF it must have been made with."""

    log: str  # path of a finished log
    sensor: str  # name of the sensor whose YAML converts the raw samples
    dof: Annotated[int, Within(1, 100)]  # number of unlocked joints

    @contextlib.contextmanager
    def open(self) -> Iterator["ReplayedWorld"]:
        """Check the log and start at its beginning; raises BadInput for no log, a broken one, or one of another sensor or dof."""
        path = Path(self.log).expanduser()
        made_with = read_metadata(path)
        if (made_with.get("sensor"), made_with.get("dof")) != (self.sensor, str(self.dof)):
            was = f"sensor={made_with.get('sensor')} dof={made_with.get('dof')}"
            raise BadInput(f"backend.log={self.log} was made with {was}, but sensor={self.sensor} dof={self.dof} is set. Type {was}.")
        records = read_samples(path)
        with contextlib.closing(records):
            yield ReplayedWorld(self.log, records, read_end(path), json.loads(made_with.get("devices", "{}")), made_with.get("started"))


class ReplayedWorld:
    """Live world of a log. A span of samples ends where it ended in the log, if the same span is requested; else by its length."""

    def __init__(
        self, name: str, records: Iterator[WorldSample], end_ns: int, identities: Mapping[str, str | None] = MappingProxyType({}),
        began_utc: str | None = None,
    ) -> None:  # fmt: skip
        self.began_utc = began_utc  # when the logged world opened; None of a simulation
        self.identities = identities  # what the devices of the logged world said of themselves
        self._name, self._log, self._end_ns = name, ReplayTape(records), end_ns
        self._t_ns, self._last_ns, self._gap_ns = 0, 0, 1
        self._pending: list[Event] = []
        self.differing = 0  # number of commands that differ from those of the log

    @property
    def t_ns(self) -> int:
        """Nanoseconds since the logged world opened."""
        return self._t_ns

    def guard_account(self) -> GuardAccount | None:
        """What the guard of the logged run held its arm to by now; None if the log does not say."""
        return None if self._log.guard is None else GuardAccount.from_json(self._log.guard)

    def move(self, q_rad: Array, over_s: float) -> float:
        """Do nothing: the joints are those of the log. An Event reports a command that differs from the log's.

        Returns the duration of the logged move, so that a filter that requests other moves stays synchronous with the log.
        """
        logged = self._compare("move", move_text(q_rad, over_s))
        return over_s if logged is None else float(logged.split(" ", 1)[0])

    def present(self, source: str) -> None:
        """Do nothing; compared with the log as in `move`. Raises BadInput for an unknown source."""
        if source not in _SOURCES:
            raise BadInput(f"present('{source}') was asked for, but a world has {', '.join(_SOURCES)}.")
        self._compare("present", source)

    def samples(self, for_s: float) -> Iterator[WorldSample]:
        """Yield the logged samples and truths of the next `for_s` seconds. Raises WorldEnded when the log does not last that long."""
        until_ns = self._t_ns + nanoseconds(for_s)
        as_logged = self._log.begins_span(for_s)
        yield from self._pop_pending()
        while self._log.has_more(None if as_logged else until_ns):
            self._skip_commands()
            sample = self._log.take()
            self._advance_time(sample.t_ns)
            yield sample
        yield from self._pop_pending()
        self._end_span(until_ns, as_logged)

    def _advance_time(self, t_ns: int) -> None:
        if t_ns > self._last_ns:
            self._gap_ns, self._last_ns = t_ns - self._last_ns, t_ns
        self._t_ns = max(self._t_ns, t_ns)

    def _end_span(self, until_ns: int, as_logged: bool) -> None:
        # A world in whole ticks stops short of `until_ns`; the log has ended only if a further tick would have fitted in.
        # Before the first tick its length is unknown; then the span mark of the log is used.
        unknown = as_logged and self._last_ns == 0
        if self._log.head is None and not unknown and self._end_ns + self._gap_ns <= until_ns:
            raise WorldEnded(
                f"backend.log={self._name} ends at {seconds(self._end_ns):.3f} s, but samples until {seconds(until_ns):.3f} s are needed. "
                f"Replay the stages that it was made with, or shorten them."
            )
        self._t_ns = max(self._t_ns, self._log.next_ns(self._end_ns)) if as_logged else until_ns

    def _compare(self, kind: str, text: str) -> str | None:
        commands = self._log.commands
        logged = commands.popleft() if commands and commands[0].kind == kind else None
        if logged is None or logged.text != text:
            self._record_difference(f"'{kind} {text}' was asked for where the log has {f'{kind} {logged.text}' if logged else 'nothing'!r}")
        return logged.text if logged else None

    def _skip_commands(self) -> None:
        while self._log.commands:
            logged = self._log.commands.popleft()
            self._record_difference(f"nothing was asked for where the log has '{logged.kind} {logged.text}'")

    def _record_difference(self, what: str) -> None:
        self.differing += 1
        if self.differing == 1:  # after the first difference the rest is not comparable
            text = f"{what}: from here on the samples are those of the logged path, not of the path asked for"
            self._pending.append(Event(self._t_ns, "replay", text))

    def _pop_pending(self) -> Iterator[Event]:
        while self._pending:
            yield self._pending.pop(0)
