"""The loop over stages, usable without Hydra: `Context`, `check_order`, `run_stages`, and `Watched`, the world as stages see it."""

import math
import typing
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from oio import stopping
from oio.arm import Arm
from oio.errors import BadInput
from oio.log import RunLog
from oio.protocols import Sensor, Stage, World
from oio.records import Array, Event, GasReading, GasSample, JointState, Sample
from oio.ways import lasts_s, planned

R = TypeVar("R")


class Watched:
    """A world that is logged and guarded: every sample reaches the log before a stage sees it, every command is checked.

    Truth goes to the log only; no stage can see it through this door. Nor can it see gas at the sensor's upper rail (`highest_raw`): a
    fit that took it for a value would put the source where the gas is just so strong.
    """

    def __init__(self, world: World, arm: Arm, log: RunLog, highest_raw: float = math.inf) -> None:
        self._world, self._arm, self._log, self._highest_raw = world, arm, log, highest_raw
        self._goal = arm.home

    @property
    def t_ns(self) -> int:
        """Nanoseconds since the world opened."""
        return self._world.t_ns

    def samples(self, for_s: float) -> Iterator[Sample]:
        """Let `for_s` seconds pass; yield joint states and gas samples in time order."""
        # where a span began: worlds end a span on their own ticks, and a replay must end it where this one did
        self._log.write(Event(self.t_ns, "span", repr(float(for_s))))
        for sample in self._world.samples(for_s):
            self._log.write(sample)
            stopping.check()
            if isinstance(sample, JointState) or (isinstance(sample, GasSample) and sample.raw < self._highest_raw):
                yield sample

    def move(self, q_rad: Array) -> float:
        """Begin a smooth move to q_rad (n,); returns the seconds it takes. Raises BadInput for a goal out of limits or without a way."""
        goal = self._arm.checked(q_rad)
        over_s = self.move_s(goal)
        self._log.write(Event(self.t_ns, "move", move_text(goal, over_s)))
        self._goal = goal
        return self._world.move(goal, over_s)

    def move_s(self, q_rad: Array) -> float:
        """Seconds that a move to q_rad (n,) would take. Raises BadInput if there is no way on which the nose stays in its box."""
        return lasts_s(planned(self._arm, self._goal, q_rad))

    def present(self, source: str) -> None:
        """Open one gas source: `none`, `beacon` or `source`. What was sensed before it was open goes to the log, and to no stage."""
        self._log.write(Event(self.t_ns, "present", source))
        self._world.present(source)
        for _ in self.samples(0.0):  # a real world went on while nobody asked: its nose smelt the source before
            pass

    @property
    def goal(self) -> Array:
        """The joints (n,) rad last asked for."""
        return self._goal


def move_text(goal: Array, over_s: float) -> str:
    """How a command stands in the log; a replay compares its commands with these."""
    return f"{float(over_s)!r} s to {np.round(goal, 4).tolist()}"


@dataclass(frozen=True)
class Context:
    """What a stage may touch: five doors and no more."""

    world: Watched
    log: RunLog
    rng: np.random.Generator
    out: Path
    results: Mapping[type, object]

    def need(self, kind: type[R]) -> R:
        """The result of that type from an earlier stage."""
        found = self.results[kind]
        assert isinstance(found, kind)
        return found


def gives(stage: Stage) -> type:
    """The type of a stage's result: the return annotation of `run`."""
    kind = typing.get_type_hints(type(stage).run).get("return")
    if not isinstance(kind, type):
        raise BadInput(f"stage {type(stage).__name__}.run must be annotated with the class of its result.")
    return kind


def check_order(stages: Mapping[str, Stage]) -> None:
    """Refuse, before anything moves, a stage whose need nobody gives and a result given twice."""
    given: dict[type, str] = {}
    for name, stage in stages.items():
        for need in stage.needs:
            if need not in given:
                raise BadInput(
                    f"stage '{name}' needs {need.__name__}, but no stage before it gives one: the order is {list(stages)}. "
                    f"{_who_gives(need, stages)}"
                )
        kind = gives(stage)
        if kind in given:
            raise BadInput(f"stages '{given[kind]}' and '{name}' both give {kind.__name__}. Leave one of them out of stage=[...].")
        given[kind] = name


def _who_gives(need: type, stages: Mapping[str, Stage]) -> str:
    giver = next((name for name, stage in stages.items() if gives(stage) is need), None)
    if giver is not None:
        return f"Put '{giver}' earlier."
    return "Add the stage that gives it to stage=[...]; `python -m oio.run --help` lists the stages and what they give."


def run_stages(
    stages: Mapping[str, Stage], world: World, arm: Arm, log: RunLog, out: Path, seed: int, highest_raw: float = math.inf
) -> dict[type, object]:
    """Run every stage in order; each has a random stream of its own, so a new stage cannot shift another's noise.

    `highest_raw` is that of the sensor: stages see no gas that is not below it.
    """
    check_order(stages)
    results: dict[type, object] = {}
    watched = Watched(world, arm, log, highest_raw)
    for name, stage in stages.items():
        rng = np.random.default_rng([seed, zlib.crc32(name.encode())])
        with log.stage(name, lambda: watched.t_ns) as close:
            result = stage.run(Context(watched, log, rng, out, results))
            close(result)
        results[gives(stage)] = result
    return results


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
