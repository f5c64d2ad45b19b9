"""A run's log as a record: the readings of its stages in clean air, and its approaches to the beacon."""

from pathlib import Path

import numpy as np
import yaml

from oio.core.errors import BadInput
from oio.core.records import Array, Event, JointState, seconds
from oio.figures.dead_reckoning import encoders
from oio.identify.record import Approaches, ElementReadings, Record
from oio.log import read_attachment, read_end, read_metadata, read_readings, read_samples, read_stages

CLEAN = ("warm_up", "baseline")  # stages without a source
ALL = "all"
CAUTION = "A run is short: what it cannot tell is said above; stage.warm_up.drift_record_s=3600 records an hour of clean air."


def read_logged_run(path: Path, stages: list[str]) -> Record:
    """Read the readings of these stages (default: those in clean air; `all`: the whole log) from a run's folder or log.

    Raises BadInput for anything else, and for a stage that the log has not.
    """
    log = path / "run.mcap" if path.is_dir() else path
    identity, spans = read_metadata(log), _spans(log)
    chosen = stages or [stage for stage in CLEAN if stage in spans]
    unknown = [stage for stage in chosen if stage not in (*spans, ALL)]
    if unknown or not chosen:
        raise BadInput(f"{log} has no stage {', '.join(unknown or CLEAN)}; it has {', '.join(spans)}. Type e.g. --stage all.")
    inside = [(0.0, np.inf)] if ALL in chosen else [spans[stage] for stage in chosen]
    elements = _elements(log, identity.get("sensor", "element"), inside)
    about = f"{log}: stages {', '.join(chosen)}"
    return Record(elements, "ppm", about, CAUTION, approaches=_approaches(log, identity, elements, spans))


def _spans(log: Path) -> dict[str, tuple[float, float]]:
    began, spans = dict[str, float](), dict[str, tuple[float, float]]()
    for t_ns, stage, state in read_stages(log):
        if state == "begin":
            began[stage], spans[stage] = seconds(t_ns), (seconds(t_ns), seconds(read_end(log)))
        elif stage in began:
            spans[stage] = (began[stage], seconds(t_ns))
    return spans


def _elements(log: Path, sensor: str, spans: list[tuple[float, float]]) -> tuple[ElementReadings, ...]:
    found: dict[int, list[tuple[float, float]]] = {}
    for reading in read_readings(log):
        t_s = seconds(reading.t_ns)
        if not reading.missed and any(begin_s <= t_s <= end_s for begin_s, end_s in spans):
            found.setdefault(reading.element, []).append((t_s, reading.ppm))
    if not found:
        raise BadInput(f"{log} has no readings in these stages. Type --stage all for the whole log.")
    columns = {element: np.array(sorted(dict(rows).items())) for element, rows in sorted(found.items())}
    return tuple(ElementReadings(f"{sensor} {element}", rows[:, 0], rows[:, 1]) for element, rows in columns.items())


def _approaches(
    log: Path, identity: dict[str, str], clean: tuple[ElementReadings, ...], spans: dict[str, tuple[float, float]]
) -> Approaches | None:
    """Range to the beacon and readings of the first element while it was open; None if the log cannot tell the range."""
    if "map_beliefs" not in spans:
        return None
    arm, beacon = encoders(log, identity), _beacon(log)
    begin_s, end_s = _presented(log, "beacon")
    if arm is None or beacon is None or end_s <= begin_s:
        return None
    joints = [s for s in read_samples(log) if isinstance(s, JointState) and begin_s <= seconds(s.t_ns) <= end_s]
    (first, *_) = _elements(log, "", [(begin_s, end_s)])
    if len(first.t_s) < 2 or not joints:
        return None
    noses = [(seconds(t_ns), float(np.linalg.norm(p_m - beacon))) for t_ns, p_m in arm.noses(joints)]
    t_s, range_m = (np.array(column) for column in zip(*noses, strict=True))
    period_s = float(np.median(np.diff(first.t_s)))
    grid_s = np.arange(max(t_s[0], first.t_s[0]), min(t_s[-1], first.t_s[-1]), period_s)
    ppm = np.interp(grid_s, first.t_s, first.value) - float(np.median(clean[0].value))
    return Approaches(period_s, np.interp(grid_s, t_s, range_m), ppm)


def _beacon(log: Path) -> Array | None:
    try:
        position = np.array(yaml.safe_load(read_attachment(log, "config.yaml"))["beacon"]["position"], dtype=np.float64)
    except (BadInput, yaml.YAMLError, KeyError, TypeError, ValueError):
        return None
    return position if position.shape == (3,) and np.all(np.isfinite(position)) else None


def _presented(log: Path, source: str) -> tuple[float, float]:
    """Begin and end of the first time that a source was open [s]; of no length if it never was."""
    begin_s: float | None = None
    for sample in read_samples(log):
        if isinstance(sample, Event) and sample.kind == "present":
            if begin_s is not None and sample.text != source:
                return begin_s, seconds(sample.t_ns)
            begin_s = seconds(sample.t_ns) if sample.text == source and begin_s is None else begin_s
    return (0.0, 0.0) if begin_s is None else (begin_s, seconds(read_end(log)))
