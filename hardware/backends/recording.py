"""A real recording played as a world: its time passes as it did, its rows become gas samples, and the nose moves among its sensors."""

import contextlib
from collections.abc import Iterator
from typing import NoReturn

import numpy as np

from hardware.recordings.playback import Playback
from hardware.recordings.recording_parts import Loader
from hardware.recordings.sensor_array import placement_for
from oio.core.errors import BadInput, WorldEnded
from oio.core.interfaces import Sensor
from oio.core.records import Array, Event, GasSample, JointState, Truth, WorldSample, nanoseconds
from oio.core.settings import settings
from oio.kinematics.arm import Arm


@settings
class Recording:
    """Which recording, read as which sensor's, carried by which arm."""

    recording: Loader
    sensor: Sensor
    arm: Arm

    @contextlib.contextmanager
    def open(self) -> Iterator["RecordedWorld"]:
        """Read the files and stand before the first usable row; raises BadInput if files, sensor and arm do not fit together."""
        yield RecordedWorld(self)


class RecordedWorld:
    """The live world. Each source has a reel that goes on where it was left, so no row is ever played twice.

    Time is counted in nanoseconds since the first usable row; changing reels does not turn it back.
    """

    def __init__(self, chosen: Recording) -> None:
        self._name, self._sensor, self._arm = chosen.recording.name, chosen.sensor, chosen.arm
        parts = chosen.recording.parts()
        self._nose = placement_for(self._name, parts["none"].recorded, chosen.sensor, chosen.arm)
        accounts = dict.fromkeys(part.recorded.account for part in parts.values())
        self._unsaid = [Event(0, "dropped", account) for account in accounts]
        self._reels = {source: Playback(f"recording '{self._name}', '{source}'", part) for source, part in parts.items()}
        self._source, self._t_ns, self._sniffs = "none", 0, 0
        self._reel.resume(0)

    @property
    def t_ns(self) -> int:
        """Nanoseconds since the world opened."""
        return self._t_ns

    @property
    def _reel(self) -> "Playback":
        return self._reels[self._source]

    def present(self, source: str) -> None:
        """Change to the part that was recorded with this source; raises BadInput if there is none."""
        if source not in self._reels:
            raise BadInput(f"recording '{self._name}' has no '{source}', only {', '.join(self._reels)}; use stage=[warm_up,baseline].")
        self._reel.pause(self._t_ns)
        self._source = source
        self._reel.resume(self._t_ns)

    def move(self, q_rad: Array, over_s: float) -> float:
        """Read the nearest recorded place from now on: nothing travels, so `over_s` is only time that passes."""
        self._nose.move(q_rad)
        return over_s

    def samples(self, for_s: float) -> Iterator[WorldSample]:
        """Play `for_s` seconds: truth, joints and gas at every row. Raises WorldEnded after the last row of the part."""
        until_ns = self._t_ns + nanoseconds(for_s)
        while self._unsaid:
            yield self._unsaid.pop(0)
        if for_s > 0 and self._reel.due_ns > self._t_ns:
            yield self._joints()
        while self._reel.due_ns < until_ns:
            self._t_ns = self._reel.due_ns
            yield from self._row()
        if until_ns > self._reel.end_ns:
            self._end()
        self._t_ns = until_ns

    def _row(self) -> Iterator[WorldSample]:
        element = self._sniffs % self._sensor.elements
        ppm = self._reel.ppm(self._nose.column(element))
        source_m = self._reel.part.source_m
        nothing_m = np.full(3, np.nan)
        yield Truth(self._t_ns, self._nose.q, self._arm.nose(self._nose.q), nothing_m if source_m is None else source_m, ppm)
        yield self._joints()
        self._reel.advance()  # only now: a caller who stops before the gas finds it at the next call
        self._sniffs += 1
        yield GasSample(self._t_ns, element, self._sensor.raw(ppm))

    def _joints(self) -> JointState:
        still = np.zeros_like(self._nose.q)
        return JointState(self._t_ns, self._nose.q, still, still)

    def _end(self) -> NoReturn:
        self._t_ns = self._reel.end_ns
        raise WorldEnded(
            f"recording '{self._name}' has no more than {self._reel.length_s:.0f} s for '{self._source}'. "
            f"Shorten the stages before, or ask for fewer trials."
        )
