"""The context of a stage, everything it may use; and `sniff`, the move-and-dwell that stages share."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from oio.core.interfaces import Sensor
from oio.core.records import Array, GasReading, JointState
from oio.log import RunLog
from oio.runtime.guarded_world import GuardedWorld

R = TypeVar("R")


@dataclass(frozen=True)
class Context:
    """World, log, random numbers, output folder and earlier results; no configuration."""

    world: GuardedWorld
    log: RunLog
    rng: np.random.Generator
    out: Path
    results: Mapping[type, object]

    def need(self, kind: type[R]) -> R:
        """The result of that type from an earlier stage; `check_order` has made sure that there is one."""
        found = self.results[kind]
        assert isinstance(found, kind)
        return found


def sniff(context: Context, sensor: Sensor, goal: Array, dwell_s: float) -> Iterator[JointState | GasReading]:
    """Move to goal (n,) rad and dwell there; yields joint states and readings in time order from the start of the move, readings logged."""
    over_s = context.world.move(goal)
    for sample in context.world.samples(over_s + dwell_s):
        if isinstance(sample, JointState):
            yield sample
        else:
            reading = sensor.reading(sample)
            context.log.reading(reading)
            yield reading
