"""A whole log in one pass: all that a figure or a report needs, by kind, each in written order."""

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from oio.core.records import Array, Belief, Event, FilterEstimate, GasReading, Innovation, WorldSample
from oio.log import decode
from oio.log.read import read_kinds
from oio.log.scene import belief_scene
from oio.log.validation import check


@dataclass(frozen=True)
class LoggedRun:
    """Contents of a log: metadata; samples of the world without a stage's progress; readings; beliefs with the names of their entries;
    odometry and hypotheses as `read_odometry` and `read_hypotheses` have them; begin and end of stages; results by stage."""

    metadata: dict[str, str]
    samples: list[WorldSample] = field(default_factory=list)
    readings: list[GasReading] = field(default_factory=list)
    states: list[tuple[tuple[str, ...], Belief]] = field(default_factory=list)
    innovations: list[Innovation] = field(default_factory=list)
    odometry: list[tuple[int, Array, Array]] = field(default_factory=list)
    others: list[FilterEstimate] = field(default_factory=list)  # by the other filters of the stage evaluate
    hypotheses: list[tuple[int, list[tuple[Array, Array]]]] = field(default_factory=list)
    stages: list[tuple[int, str, str]] = field(default_factory=list)
    results: dict[str, Any] = field(default_factory=dict)


def read_run(path: Path) -> LoggedRun:
    """Read a finished log; raises BadInput for anything else."""
    run = LoggedRun(check(path))
    kept: dict[str, Callable[[Any], None]] = {
        "oio.v1.GasReading": run.readings.append, "oio.v1.State": run.states.append, "oio.v1.Innovation": run.innovations.append,
        "foxglove.Odometry": run.odometry.append, "oio.v1.FilterEstimate": run.others.append,
    }  # fmt: skip
    for kind, record in read_kinds(path, _DECODERS):
        if kind in kept:
            kept[kind](record)
        elif kind == "foxglove.SceneUpdate":
            run.hypotheses.extend([] if record is None else [(record.t_ns, record.hypotheses)])
        elif kind == "oio.v1.StageResult":
            _stage(run, *record)
        elif not (isinstance(record, Event) and record.kind == "progress"):
            run.samples.append(record)
    return run


def _stage(run: LoggedRun, event: tuple[int, str, str], result: str) -> None:
    run.stages.append(event)
    if event[2] == "end" and result:
        run.results[event[1]] = json.loads(result)


def _stage_with_result(t_ns: int, data: bytes) -> tuple[tuple[int, str, str], str]:
    return decode.stage(t_ns, data), decode.stage_json(data)


_DECODERS: dict[str, Callable[[int, bytes], Any]] = {
    **decode.SAMPLES, "oio.v1.GasReading": decode.reading, "oio.v1.State": decode.named_belief, "oio.v1.Innovation": decode.innovation,
    "oio.v1.FilterEstimate": decode.filter_estimate,
    "foxglove.Odometry": decode.odometry, "foxglove.SceneUpdate": belief_scene, "oio.v1.StageResult": _stage_with_result,
}  # fmt: skip
