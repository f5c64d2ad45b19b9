"""Entries of a log to the Rerun viewer: arm, nose, joints, readings, NIS, belief, events. Many rows go together, a few times a second."""

import time
from collections import defaultdict
from collections.abc import Callable
from typing import Any

import numpy as np

from oio.core.records import Array, Event, GasReading, Innovation, JointState, Truth
from oio.log import ArmFrames, BeliefScene, BelievedNose, Entry, Progress, Setup, StageMark
from oio.view.column_buffer import ColumnBuffer
from oio.view.rerun_columns import ARM, BELIEF, LINES, NOSE_BELIEVED, SOURCE, VERDICT, RerunColumns
from oio.view.rerun_setup import draw_setup

PERIOD_S, SENDING = 0.25, 0.01  # of the wall clock between two sendings at least, and the share of the time that sending takes at most
JOINTS, NIS = "joints", "nis"
LEVELS = {"PASS": "INFO", "WARN": "WARN", "FAIL": "ERROR"}  # of a verdict
TOLD_OTHERWISE = ("span", "progress", "move")  # kinds of events, of which there are many


class RerunStream:
    """A watcher for `RunLog.watchers`."""

    def __init__(self, recording: Any) -> None:
        self._recording, self._columns = recording, RerunColumns(recording)
        self._buffers = defaultdict[str, ColumnBuffer](ColumnBuffer)
        self._joints: Array | None = None
        self._source = b""  # that was sent
        self._due_s = 0.0  # clock of the display alone
        self._taking: dict[type, Callable[[Any], None]] = {
            ArmFrames: self._arm, GasReading: self._reading, Innovation: self._innovation, Truth: self._truth, Setup: self._setup,
            BelievedNose: self._believed, BeliefScene: self._belief, StageMark: self._mark, Progress: self._progress, Event: self._event,
        }  # fmt: skip

    def describe(self, name: str, began_ns: int) -> None:
        """Give the recording a name, and a time of day when its world opened: nanoseconds since 1970, 0 for none."""
        self._recording.send_recording_name(name)
        if began_ns:
            self._recording.send_recording_start_time_nanos(began_ns)
            self._columns.began(began_ns)

    def __call__(self, entry: Entry) -> None:
        """Take up an entry; send what has gathered if it is time."""
        if type(entry) is JointState:
            self._joints = entry.q
            return  # most entries are, and it costs nothing to say so first
        take = self._taking.get(type(entry))
        if take is not None:
            take(entry)
        now = time.monotonic()
        if now >= self._due_s:
            self.flush()
            sent = time.monotonic()
            self._due_s = sent + max(PERIOD_S, (sent - now) / SENDING)

    def flush(self) -> None:
        """Send what has gathered."""
        for path, buffer in self._buffers.items():
            if buffer.t_ns:
                self._columns.send(path, *buffer.taken())

    def _arm(self, frames: ArmFrames) -> None:
        self._buffers[ARM].add(frames.t_ns, frames)
        if self._joints is not None:
            self._buffers[JOINTS].add(frames.t_ns, self._joints)

    def _reading(self, reading: GasReading) -> None:
        self._buffers[f"gas/element_{reading.element}"].add(reading.t_ns, reading.ppm)

    def _innovation(self, innovation: Innovation) -> None:
        try:
            self._buffers[NIS].add(innovation.t_ns, innovation.nis)
        except np.linalg.LinAlgError:
            return  # a singular covariance has none

    def _believed(self, nose: BelievedNose) -> None:
        self._buffers[NOSE_BELIEVED].add(nose.t_ns, nose.nose_m)

    def _truth(self, truth: Truth) -> None:
        """The true source, when it is another."""
        at = truth.source_m.tobytes()
        if at != self._source:
            self._source = at
            self._buffers[SOURCE].add(truth.t_ns, truth.source_m)

    def _belief(self, scene: BeliefScene) -> None:
        self._buffers[BELIEF].add(scene.t_ns, scene)

    def _mark(self, mark: StageMark) -> None:
        told = f"{mark.stage}: {mark.state}{f', {mark.why}' if mark.why else ''}"
        self._say(mark.t_ns, told, "ERROR" if mark.state == "failed" else "INFO")

    def _progress(self, progress: Progress) -> None:
        self._say(progress.t_ns, f"{progress.stage}: {progress.waits_for}: {progress.figure}", "DEBUG")

    def _event(self, event: Event) -> None:
        if event.kind == "verdict":
            self._say(event.t_ns, f"verdict: {event.text}", LEVELS.get(event.text[:4], "INFO"))
            self._buffers[VERDICT].add(event.t_ns, event.text)
        elif event.kind not in TOLD_OTHERWISE:
            self._say(event.t_ns, f"{event.kind}: {event.text}", "INFO")

    def _say(self, t_ns: int, text: str, level: str) -> None:
        self._buffers[LINES].add(t_ns, (text, level))

    def _setup(self, setup: Setup) -> None:
        draw_setup(self._recording, setup)
        self._buffers[VERDICT].add(0, "none yet: it comes at the end of the run")
