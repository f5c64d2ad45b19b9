"""World of a real recording: its time passes as recorded, its rows become gas samples, and the nose moves among its sensors."""

import contextlib
from collections.abc import Iterator
from dataclasses import replace
from typing import NoReturn

import numpy as np

from hardware.recordings.playback import Playback
from hardware.recordings.recording_parts import Loader, measured
from hardware.recordings.sensor_array import not_played, placement_for
from oio.core.errors import BadInput, WorldEnded
from oio.core.interfaces import Sensor
from oio.core.records import Array, Event, GasSample, JointState, Truth, WorldSample, nanoseconds
from oio.core.settings import settings
from oio.kinematics.arm import Arm


@settings
class Recording:
    """Configuration: the recording, the sensor that its values are taken for, and the arm that carries it."""

    recording: Loader
    sensor: Sensor
    arm: Arm

    @contextlib.contextmanager
    def open(self) -> Iterator["RecordedWorld"]:
        """Read the files and start before the first usable row; raises BadInput if files, sensor and arm do not fit together."""
        yield RecordedWorld(self)


class RecordedWorld:
    """Live world of a recording. Each source has a playback that resumes where it was paused, so no row is played twice.

    Time is counted in nanoseconds since the first usable row; it does not go back when the source changes.
    """

    def __init__(self, chosen: Recording) -> None:
        self._name, self._sensor, self._arm = chosen.recording.name, chosen.sensor, chosen.arm
        parts = {
            source: replace(part, recorded=measured(part.recorded, chosen.sensor)) for source, part in chosen.recording.parts().items()
        }
        self._placement = placement_for(self._name, parts["none"].recorded, chosen.sensor, chosen.arm)
        accounts = tuple(dict.fromkeys(part.recorded.account for part in parts.values()))
        guessed = tuple(dict.fromkeys(note for part in parts.values() for note in part.recorded.notes))
        self._pending_events = [Event(0, kind, text) for kind, texts in (("dropped", accounts), ("mapping", guessed)) for text in texts]
        spare = not_played(parts["none"].recorded, chosen.sensor)
        self.notes = (*(f"read off the file: {note}" for note in guessed), *accounts, *([spare] if spare else ()))  # shown at the start
        self._playbacks = {source: Playback(f"recording '{self._name}', '{source}'", part) for source, part in parts.items()}
        self._source, self._t_ns, self._sniffs = "none", 0, 0
        self._playback.resume(0)

    @property
    def t_ns(self) -> int:
        """Nanoseconds since the world opened."""
        return self._t_ns

    @property
    def _playback(self) -> "Playback":
        return self._playbacks[self._source]

    def present(self, source: str) -> None:
        """Switch to the part recorded with this source; raises BadInput if there is none."""
        if source not in self._playbacks:
            raise BadInput(f"recording '{self._name}' has no '{source}', only {', '.join(self._playbacks)}; use stage=[warm_up,baseline].")
        self._playback.pause(self._t_ns)
        self._source = source
        self._playback.resume(self._t_ns)

    def move(self, q_rad: Array, over_s: float) -> float:
        """Read the nearest recorded position from now on; nothing moves, so `over_s` is only time that passes."""
        self._placement.move(q_rad)
        return over_s

    def samples(self, for_s: float) -> Iterator[WorldSample]:
        """Play `for_s` seconds: truth, joints and gas at every row. Raises WorldEnded after the last row of the part."""
        until_ns = self._t_ns + nanoseconds(for_s)
        while self._pending_events:
            yield self._pending_events.pop(0)
        if for_s > 0 and self._playback.due_ns > self._t_ns:
            yield self._joints()
        while self._playback.due_ns < until_ns:
            self._t_ns = self._playback.due_ns
            yield from self._play_row()
        if until_ns > self._playback.end_ns:
            self._raise_end()
        self._t_ns = until_ns

    def _play_row(self) -> Iterator[WorldSample]:
        element = self._sniffs % self._sensor.elements
        ppm = self._playback.ppm(self._placement.column(element))
        source_m = self._playback.part.source_m
        unknown_m = np.full(3, np.nan)
        yield Truth(self._t_ns, self._placement.q, self._arm.nose(self._placement.q), unknown_m if source_m is None else source_m, ppm)
        yield self._joints()
        self._playback.advance()  # only now: a caller that stops before the gas sample gets it at the next call
        self._sniffs += 1
        yield GasSample(self._t_ns, element, self._sensor.raw(ppm))

    def _joints(self) -> JointState:
        zeros = np.zeros_like(self._placement.q)
        return JointState(self._t_ns, self._placement.q, zeros, zeros)

    def _raise_end(self) -> NoReturn:
        self._t_ns = self._playback.end_ns
        part = f" with source '{self._source}'" if len(self._playbacks) > 1 else ""
        raise WorldEnded(
            f"recording '{self._name}' ends after {self._playback.length_s:.0f} s{part}, before the stages do. Record for longer, or type "
            f"fewer stages, e.g. stage=[warm_up]."
        )
