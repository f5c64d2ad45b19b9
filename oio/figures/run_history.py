"""Run history for the figures: true and believed trajectories of nose and source, dead reckoning, and gas readings."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from oio.core.records import Array, Event, GasReading, JointState, Truth, WorldSample, seconds
from oio.figures.dead_reckoning import Encoders, encoders
from oio.log import LoggedRun, read_end, read_run

SEARCH = "navigate"
SOURCE = ("source_x", "source_y", "source_z")


@dataclass(frozen=True, slots=True)
class Span:
    """Time span of one stage [s] since the world opened."""

    stage: str
    begin_s: float
    end_s: float


@dataclass(frozen=True, slots=True, eq=False)
class TrackOverTime:
    """Trajectory: t_s (k,) s, p_m (k, 3) m in the base frame, cov_m2 (k, 3, 3) m^2 (zero where nothing is uncertain)."""

    t_s: Array
    p_m: Array
    cov_m2: Array

    def __len__(self) -> int:
        return len(self.t_s)

    def during(self, span: Span) -> "TrackOverTime":
        """Return the part inside a span."""
        inside = (self.t_s >= span.begin_s) & (self.t_s <= span.end_s)
        return TrackOverTime(self.t_s[inside], self.p_m[inside], self.cov_m2[inside])

    def distances(self, truth: "TrackOverTime") -> tuple[Array, Array]:
        """Return t_s (j,) and distance (j,) m at common time stamps only: in 20 ms the nose moves by more than its error."""
        t_s, own, other = np.intersect1d(self.t_s, truth.t_s, return_indices=True)
        return t_s, np.linalg.norm(self.p_m[own] - truth.p_m[other], axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class RunHistory:
    """History of a run. Trajectories and places may be empty: hardware has no truth, and a search may end before its first map."""

    identity: dict[str, str]
    spans: tuple[Span, ...]
    search: Span  # the whole run if it has no search stage
    readings: tuple[GasReading, ...]
    truth: TrackOverTime
    odometry: TrackOverTime
    dead: TrackOverTime  # dead reckoning: forward kinematics of the encoders
    source: TrackOverTime  # as believed
    shoulder_m: Array  # (3,) origin of bearings
    links_m: Array  # (j + 1, 3) m: joints and nose as the arm stood at the end; (0, 3) without its model
    places: dict[str, Array]  # true positions of the `beacon` and the `source`, (3,) m

    @property
    def dof(self) -> int:
        """Number of joints that moved; below three only the bearing of a source is observable."""
        return int(self.identity.get("dof", "0"))


def read_run_history(path: Path) -> RunHistory:
    """Read the run history of a finished log; raises BadInput for anything else."""
    return run_history(read_run(path), path)


def run_history(run: LoggedRun, path: Path) -> RunHistory:
    """Return the history of a log that was read from `path`."""
    whole = Span("", 0.0, seconds(read_end(path)))
    spans = tuple(_spans(run.stages, whole.end_s))
    search = next((span for span in reversed(spans) if span.stage == SEARCH), whole)
    arm = encoders(path, run.metadata)
    truth, joints, places = _world(run.samples)
    dead = track_over_time([(t, p, None) for t, p in arm.noses(joints)] if arm else [])
    odometry, source = track_over_time(run.odometry), track_over_time(_sources(run, search.begin_s))
    truth, odometry, dead, source = (c.during(search) for c in (truth, odometry, dead, source))
    return RunHistory(
        run.metadata, spans, search, tuple(run.readings), truth, odometry, dead, source, _shoulder(arm), _links(arm, joints), places
    )


def track_over_time(rows: Any) -> TrackOverTime:
    """Return the trajectory of (t_ns, p (3,) m, covariance (3, 3) m^2 or None); entries that are not finite are left out."""
    rows = list(rows)
    if not rows:
        return TrackOverTime(np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3, 3)))
    t_s, p = np.array([seconds(t_ns) for t_ns, _, _ in rows]), np.array([at for _, at, _ in rows], dtype=float)
    cov = np.array([np.zeros((3, 3)) if of is None else of for _, _, of in rows], dtype=float)
    finite = np.all(np.isfinite(p), axis=1) & np.all(np.isfinite(cov), axis=(1, 2))
    return TrackOverTime(t_s[finite], p[finite], cov[finite])


def _shoulder(arm: Encoders | None) -> Array:
    return np.zeros(3) if arm is None else arm.shoulder_m


def _links(arm: Encoders | None, joints: list[JointState]) -> Array:
    return arm.links(joints[-1].q) if arm and joints else np.zeros((0, 3))


def _spans(stages: Iterable[tuple[int, str, str]], end_s: float) -> Iterator[Span]:
    started_s: dict[str, float] = {}
    for t_ns, stage, state in stages:
        if state == "begin":
            started_s[stage] = seconds(t_ns)
        elif stage in started_s:
            yield Span(stage, started_s.pop(stage), seconds(t_ns))
    yield from (Span(stage, begin_s, end_s) for stage, begin_s in started_s.items())  # a recovered log may end inside a stage


def _world(samples: Iterable[WorldSample]) -> tuple[TrackOverTime, list[JointState], dict[str, Array]]:
    """True nose trajectory, joint states, and the true position of each source that was opened."""
    truths, joints, places, opened = [], [], dict[str, Array](), ""
    for sample in samples:
        match sample:
            case Truth():
                truths.append((sample.t_ns, sample.nose_m, None))
                if np.all(np.isfinite(sample.source_m)):
                    places[opened] = sample.source_m
            case JointState():
                joints.append(sample)
            case Event(kind="present"):
                opened = sample.text
    return track_over_time(truths), joints, places


def _sources(run: LoggedRun, since_s: float) -> list[tuple[int, Array, Array]]:
    """Believed source after every reading and, at the ends of moves, after a new map: the final estimate of a search.

    Maps made up to since_s are of the beacon.
    """
    mapped = [(t_ns, *found[0]) for t_ns, found in run.hypotheses if found and seconds(t_ns) > since_s]
    return sorted([*_filtered(run), *mapped], key=lambda row: row[0])  # stable: at equal times the map comes later


def _filtered(run: LoggedRun) -> Iterator[tuple[int, Array, Array]]:
    for names, belief in run.states:
        if all(name in names for name in SOURCE):
            at = [names.index(name) for name in SOURCE]
            yield belief.t_ns, belief.mean[at], belief.cov[np.ix_(at, at)]
