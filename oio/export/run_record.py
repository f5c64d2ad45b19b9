"""What a log holds for other tools: nose and source trajectories, joints, readings, and what the run was."""

import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array, Belief, GasReading, GasSample, JointState, Truth, WorldSample, seconds
from oio.figures.dead_reckoning import Encoders, encoders
from oio.figures.run_history import SOURCE
from oio.figures.track import TrackOverTime, track_over_time
from oio.log import LoggedRun, read_metadata, read_odometry, read_readings, read_samples, read_states

ESTIMATE, DEAD_RECKONING, TRUTH = "estimate", "dead_reckoning", "truth"


@dataclass(frozen=True, eq=False)
class RunRecord:
    """A log as tracks and tables, over the whole run; tracks that the log does not hold are empty.

    `noses`: estimate (with covariance), dead reckoning and truth; `source`: as believed; `true_source`: at the stamps of the truth.
    """

    log: Path
    identity: dict[str, str]
    noses: dict[str, TrackOverTime]
    source: TrackOverTime
    true_source: TrackOverTime
    truth_ppm: Array  # (k,) at the stamps of the true nose
    joints: tuple[JointState, ...]
    samples: tuple[GasSample, ...]
    readings: tuple[GasReading, ...]
    arm: Encoders | None

    @property
    def title(self) -> str:
        """One line: which run this is, and the version that made it."""
        known = (f"{key} {_line(self.identity[key])}" for key in ("sensor", "dof", "seed", "backend") if key in self.identity)
        return f"run {_line(str(self.log))} ({', '.join(known)}), made by OIO {_version(self.identity)}"


def find_log(run: Path) -> Path:
    """Return the log of a run folder, or the log itself. Raises BadInput for one that is unfinished, with the command that mends it."""
    finished, part = (run / "run.mcap", run / "run.mcap.part") if run.is_dir() else (run, run)
    log = part if part.is_file() and not finished.is_file() else finished
    if log.suffix == ".part":
        raise BadInput(f"{log} is the log of a run that goes on, failed or was killed. Type `python -m oio.recover {log}` and export that.")
    return log


def read_run_record(log: Path, watched: Callable[[Iterator[WorldSample]], Iterator[WorldSample]] = iter) -> RunRecord:
    """Read a finished log; its samples pass through `watched`, which may show how far it is. Raises BadInput for anything else."""
    return _record(log, read_metadata(log), watched(read_samples(log)), read_odometry(log), read_states(log), read_readings(log))


def record_of(log: Path, run: LoggedRun) -> RunRecord:
    """Return the same of a log that was read already."""
    return _record(log, run.metadata, run.samples, run.odometry, run.states, run.readings)


def _record(
    log: Path, identity: dict[str, str], world: Iterable[WorldSample], odometry: Iterable[tuple[int, Array, Array]],
    states: Iterable[tuple[tuple[str, ...], Belief]], read: Iterable[GasReading],
) -> RunRecord:  # fmt: skip
    joints, samples, truths = _sorted_out(world)
    arm = encoders(log, identity)
    noses = {
        ESTIMATE: _last_of_equal(track_over_time(odometry)),
        DEAD_RECKONING: _last_of_equal(track_over_time([(t, p, None) for t, p in arm.noses(joints)] if arm else [])),
        TRUTH: track_over_time([(truth.t_ns, truth.nose_m, None) for truth in truths]),
    }
    true_source = track_over_time([(truth.t_ns, truth.source_m, None) for truth in truths])
    ppm = np.array([truth.ppm for truth in truths if np.all(np.isfinite(truth.nose_m))])
    source, readings = _last_of_equal(track_over_time(_believed_sources(states))), tuple(read)
    return RunRecord(log, identity, noses, source, true_source, ppm, tuple(joints), tuple(samples), readings, arm)


def _sorted_out(samples: Iterable[WorldSample]) -> tuple[list[JointState], list[GasSample], list[Truth]]:
    joints, gas, truths = list[JointState](), list[GasSample](), list[Truth]()
    for sample in samples:
        match sample:
            case JointState():
                joints.append(sample)
            case GasSample():
                gas.append(sample)
            case Truth():
                truths.append(sample)
    return joints, gas, truths


def _believed_sources(states: Iterable[tuple[tuple[str, ...], Belief]]) -> Iterator[tuple[int, Array, Array]]:
    for names, belief in states:
        if all(name in names for name in SOURCE):
            at = [names.index(name) for name in SOURCE]
            yield belief.t_ns, belief.mean[at], belief.cov[np.ix_(at, at)]


def _last_of_equal(track: TrackOverTime) -> TrackOverTime:
    """The track with one entry per stamp: a map at the stamp of a reading comes after it and replaces it."""
    last = np.append(np.diff(track.t_s) > 0.0, True)[: len(track)]
    return TrackOverTime(track.t_s[last], track.p_m[last], track.cov_m2[last])


def _version(identity: dict[str, str]) -> str:
    try:
        return _line(str(json.loads(identity.get("versions", "{}")).get("oio", "of an unknown version")))
    except (ValueError, AttributeError):
        return "of an unknown version"


def _line(text: str) -> str:
    """Text of a file from outside as part of one comment line."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def rate_hz(t_s: Array, what: str, log: Path) -> float:
    """Return the median rate of stamps (k,) s; equal ones count once. Raises BadInput where there are not two of them."""
    different = np.unique(t_s)
    refuse_fewer_than_two(different, what, log)
    return 1.0 / float(np.median(np.diff(different)))


def refuse_fewer_than_two(t_s: Array, what: str, log: Path) -> None:
    """Raise BadInput where there are not two stamps (k,) s."""
    if len(t_s) < 2:
        raise BadInput(f"{log} holds {len(t_s)} {what}, but this export needs two or more. Give the log of a run that got so far.")


def stamps_s(records: Iterable[GasSample]) -> Array:
    """Return the stamps (k,) s of samples."""
    return np.array([seconds(record.t_ns) for record in records])
