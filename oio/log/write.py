"""`RunLog`: sensor data, beliefs and results of a run, appended to one MCAP file as they arrive."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from oio.core.records import (
    SECOND_NS,
    Array,
    Belief,
    Event,
    FilterEstimate,
    GasReading,
    GasSample,
    Innovation,
    Truth,
    WorldSample,
    nanoseconds,
)
from oio.log import encode, schemas
from oio.log.arm_scene import setup_scene, source_scene, transforms
from oio.log.entries import ArmFrames, BeliefScene, BelievedNose, Entry, Progress, Setup, StageMark, Watcher
from oio.log.part_file import PartialLogFile
from oio.log.plain_json import to_json
from oio.log.read import samples_written
from oio.log.scene import scene

LONG_AGO_NS = -(1 << 62)
Journal = tuple[Any, ...]  # what a log has written, to be written to another


class RunLog:
    """Open run log. Time comes from the records alone, so the same calls give the same bytes.

    `watchers` are told of every entry once it is logged.
    """

    def __init__(self, part: PartialLogFile, sensor: str, joints: tuple[str, ...]) -> None:
        self._part, self._sensor, self._joints = part, sensor, joints
        self._stage, self._last_progress_ns, self._last_estimate_ns = "", LONG_AGO_NS, LONG_AGO_NS
        self._drawn_source: Array | None = None
        self.watchers: list[Watcher] = []
        # All sample channels are declared in the first chunk, so that a reader may skip later chunks by their times.
        for topic, kind in encode.sample_topics(sensor).items():
            part.channel(topic, kind)

    @classmethod
    @contextmanager
    def create(
        cls, path: Path, *, sensor: str, joints: tuple[str, ...], metadata: dict[str, str], attachments: dict[str, bytes]
    ) -> Iterator["RunLog"]:
        """Open a log at `path`: `<path>.part` while it is written, and also after a run that fails. Raises BadInput if it exists."""
        log_metadata = {"schema_version": schemas.SCHEMA_VERSION, "sensor": sensor, "dof": str(len(joints)), "joints": " ".join(joints)}
        part = PartialLogFile(path, {**metadata, **log_metadata})
        try:
            log = cls(part, sensor, joints)
            for name, data in attachments.items():
                log.attach(name, data)
            yield log
        finally:
            part.finish()
        part.rename()

    def write(self, sample: WorldSample) -> None:
        """Log a world sample."""
        self._put(sample.t_ns, encode.world_sample(sample, self._sensor, self._joints), urgent=isinstance(sample, GasSample))
        if isinstance(sample, Truth):
            self._draw_source(sample)
        self._tell(sample)

    def reading(self, reading: GasReading) -> None:
        """Log a calibrated reading in ppm."""
        self._part.put(f"/gas/{self._sensor}/reading", reading.t_ns, encode.gas_reading(reading), urgent=True)
        self._tell(reading)

    def estimate(self, belief: Belief, names: tuple[str, ...], units: tuple[str, ...], every_s: float = 0.0) -> None:
        """Log a belief (n,), (n, n), with a name and a unit for each of the n entries; none less than `every_s` after the last one."""
        if belief.t_ns - self._last_estimate_ns < nanoseconds(every_s):
            return
        self._last_estimate_ns = belief.t_ns
        self._part.put("/estimate/state", belief.t_ns, encode.state(belief, names, units))

    def odometry(self, t_ns: int, nose_m: Array, cov: Array) -> None:
        """Log the believed nose: (3,) m and (3, 3) m^2 in frame base."""
        self._put(t_ns, encode.odometry(t_ns, nose_m, cov))
        self._tell(BelievedNose(t_ns, nose_m, cov))

    def filter_estimate(self, estimate: FilterEstimate) -> None:
        """Log what another filter made of the search, from its log; its time may be long past."""
        self._put(estimate.t_ns, encode.filter_estimate(estimate))

    def innovation(self, innovation: Innovation) -> None:
        """Log the innovation of an update."""
        self._part.put("/estimate/innovation", innovation.t_ns, encode.innovation(innovation))
        self._tell(innovation)

    def spheres(self, t_ns: int, centres: Array, radii_m: Array, hypotheses: list[tuple[Array, Array]], text: str) -> None:
        """Log a scene for the viewer: spheres (k, 3) m, (k,) m and 95 % ellipsoids of hypotheses (mean (3,) m, cov (3, 3) m^2)."""
        self._part.put("/belief/scene", t_ns, scene(t_ns, centres, radii_m, hypotheses, text))
        self._tell(BeliefScene(t_ns, centres, radii_m, hypotheses, text))

    @property
    def draws(self) -> bool:
        """Whether anybody will look at the arm."""
        return True

    def setup(self, setup: Setup) -> None:
        """Log what stands still, for viewers: links, box, beacon."""
        self._part.put("/arm/scene", 0, setup_scene(0, setup))
        self._tell(setup)

    def arm(self, frames: ArmFrames) -> None:
        """Log the frames of the arm, for viewers."""
        self._part.put("/tf", frames.t_ns, transforms(frames))
        self._tell(frames)

    def _draw_source(self, truth: Truth) -> None:
        """Draw the true source when it is another."""
        if self._drawn_source is None or not np.array_equal(self._drawn_source, truth.source_m, equal_nan=True):
            self._drawn_source = truth.source_m
            self._part.put("/truth/scene", truth.t_ns, source_scene(truth.t_ns, truth.source_m))

    def attach(self, name: str, data: bytes) -> None:
        """Attach a file to the log; of two with one name, readers return the later."""
        self._part.attach(name, data)

    @contextmanager
    def stage(self, name: str, clock: Callable[[], int]) -> Iterator[Callable[[object], None]]:
        """Log begin and end of a stage at the times of `clock`; call the yielded function with the stage's result."""
        results: list[object] = []
        outer, self._stage, self._last_progress_ns, self._last_estimate_ns = self._stage, name, LONG_AGO_NS, LONG_AGO_NS
        self._drawn_source = None  # drawn anew in every stage: a run that goes on after some of them leaves the same bytes
        self._mark(name, "begin", clock(), None)
        try:
            yield results.append
        except BaseException as error:
            self._mark(name, "failed", clock(), {"error": type(error).__name__, "text": str(error)}, str(error))
            raise
        else:
            self._mark(name, "end", clock(), results[-1] if results else None)
        finally:
            self._stage = outer

    def _mark(self, stage: str, state: str, t_ns: int, result: object, why: str = "") -> None:
        self._part.put(f"/stage/{stage}", t_ns, encode.stage_result(t_ns, stage, state, to_json(result)))
        self._part.flush()  # a long computation may follow, during which world time stands still
        self._tell(StageMark(t_ns, stage, state, why))

    def progress(self, t_ns: int, waits_for: str, figure: str) -> None:
        """Log what the running stage waits for and its progress figure; at most once per second of world time."""
        if t_ns - self._last_progress_ns < SECOND_NS:
            return
        self._last_progress_ns = t_ns
        self.write(Event(t_ns, "progress", f"{self._stage}: {waits_for}: {figure}"))
        self._tell(Progress(t_ns, self._stage, waits_for, figure))

    def samples(self, since_ns: int = -1, until_ns: int | None = None) -> Iterator[WorldSample]:
        """Return the samples written so far with since_ns < t_ns <= until_ns, in that order, read back from the file."""
        return samples_written(self._part.path, self._part.flush(), since_ns, until_ns)

    def remember(self) -> None:
        """Keep in memory what is logged from now on."""
        self._part.remember()

    def remembered(self) -> Journal:
        """Return what was logged since `remember`."""
        return self._part.remembered()

    def repeat(self, journal: Journal) -> None:
        """Log what another log of this kind remembered: the same bytes."""
        self._part.repeat(journal)

    def _put(self, t_ns: int, messages: dict[str, Any], urgent: bool = False) -> None:
        for topic, message in messages.items():
            self._part.put(topic, t_ns, message, urgent)

    def _tell(self, entry: Entry) -> None:
        for watcher in self.watchers:
            watcher(entry)
