"""Run history for the figures: true and believed trajectories of nose and source, dead reckoning, and gas readings."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from oio.core.records import Array, Event, GasReading, JointState, Truth, WorldSample, seconds
from oio.figures.dead_reckoning import Encoders, encoders
from oio.figures.track import Estimates, Span, TrackOverTime, estimates_by_variant, places_left, track_over_time
from oio.log import LoggedRun, read_end, read_run

SEARCH = "navigate"
SOURCE = ("source_x", "source_y", "source_z")
OFFSET = "offset_"  # states of the joints: what their encoders read too much


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
    links_m: Array  # (j + 1, 3) m: joints and nose at the end, by the filter or, without one, the encoders; (0, 3) without a model
    places: dict[str, Array]  # true positions of the `beacon` and the `source`, (3,) m
    left: tuple[
        tuple[Array, Array], ...
    ] = ()  # places that the last map left for the source, best first: mean (3,) m, covariance (3, 3) m^2
    others: Mapping[str, Estimates] = field(default_factory=dict)  # by variant: the filters that were run over the log again, e.g. `cold`

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
        run.metadata, spans, search, tuple(run.readings), truth, odometry, dead, source, _shoulder(arm), _links(arm, joints, run), places,
        places_left(run.results.get(SEARCH)), estimates_by_variant(run.others),
    )  # fmt: skip


def _shoulder(arm: Encoders | None) -> Array:
    return np.zeros(3) if arm is None else arm.shoulder_m


def _links(arm: Encoders | None, joints: list[JointState], run: LoggedRun) -> Array:
    if arm is None or not joints:
        return np.zeros((0, 3))
    names, belief = run.states[-1] if run.states else ((), None)
    offsets = [i for i, name in enumerate(names) if name.startswith(OFFSET)]
    drift = np.zeros(len(joints[-1].q)) if belief is None or len(offsets) != len(joints[-1].q) else belief.mean[offsets]
    return arm.links(joints[-1].q - drift)


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
