"""What a stage may touch: `Context`, five doors and no more; and `sniff`, the one move that all stages share."""

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
    """What a stage may touch: five doors and no more."""

    world: GuardedWorld
    log: RunLog
    rng: np.random.Generator
    out: Path
    results: Mapping[type, object]

    def need(self, kind: type[R]) -> R:
        """The result of that type from an earlier stage."""
        found = self.results[kind]
        assert isinstance(found, kind)
        return found


def sniff(context: Context, sensor: Sensor, goal: Array, dwell_s: float) -> Iterator[JointState | GasReading]:
    """Move to goal (n,) rad and dwell there; yields joints and readings (logged) in time order, the whole way."""
    over_s = context.world.move(goal)
    for sample in context.world.samples(over_s + dwell_s):
        if isinstance(sample, JointState):
            yield sample
        else:
            reading = sensor.reading(sample)
            context.log.reading(reading)
            yield reading
