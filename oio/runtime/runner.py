"""The loop over stages, usable without Hydra: the `Stage` protocol, `check_order`, `run_stages`."""

import copy
import math
import typing
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import ClassVar, Protocol, runtime_checkable

import numpy as np

from oio.core.errors import BadInput
from oio.core.interfaces import World
from oio.kinematics.arm import Arm
from oio.log import RunLog
from oio.runtime.arm_display import ArmDisplay
from oio.runtime.checkpoint import Checkpoint, Checkpoints, Keep
from oio.runtime.context import Context
from oio.runtime.guarded_world import GuardedWorld

Between = Callable[[str, str, GuardedWorld, RunLog], None]  # called with `before` or `after`, and the stage


@runtime_checkable
class Stage(Protocol):
    """One step of a protocol; the return annotation of `run` is the type of its result."""

    needs: ClassVar[tuple[type, ...]]

    def run(self, context: Context) -> object:
        """Gather samples through `context.world`, compute, return the result."""
        ...


def result_type(stage: Stage) -> type:
    """The type of a stage's result: the return annotation of `run`."""
    kind = typing.get_type_hints(type(stage).run).get("return")
    if not isinstance(kind, type):
        raise BadInput(f"stage {type(stage).__name__}.run must be annotated with the class of its result.")
    return kind


def check_order(stages: Mapping[str, Stage]) -> None:
    """Check the order of stages before anything moves. Raises BadInput for a missing need, and for a result that two stages give."""
    given: dict[type, str] = {}
    for name, stage in stages.items():
        for need in stage.needs:
            if need not in given:
                raise BadInput(
                    f"stage '{name}' needs {need.__name__}, but no stage before it gives one: the order is {list(stages)}. "
                    f"{_who_gives(need, stages)}"
                )
        kind = result_type(stage)
        if kind in given:
            raise BadInput(f"stages '{given[kind]}' and '{name}' both give {kind.__name__}. Leave one of them out of stage=[...].")
        given[kind] = name


def _who_gives(need: type, stages: Mapping[str, Stage]) -> str:
    giver = next((name for name, stage in stages.items() if result_type(stage) is need), None)
    if giver is not None:
        return f"Put '{giver}' earlier."
    return "Add the stage that gives it to stage=[...]; `python -m oio.run --help` lists the stages and what they give."


def run_stages(
    stages: Mapping[str, Stage], world: World, arm: Arm, log: RunLog, out: Path, seed: int, highest_raw: float = math.inf,
    begun: Checkpoint | None = None, keep: Keep | None = None, between: Between | None = None,
) -> dict[type, object]:  # fmt: skip
    """Run every stage in order; each has a random stream of its own, so a new stage cannot shift another's noise.

    `highest_raw` is that of the sensor: stages see no gas that is not below it. `begun`: go on from there, in a copy of its world.
    `keep` gets a checkpoint after every stage but the last. `between` is called before and after every stage that is run.
    """
    check_order(stages)
    display = ArmDisplay(arm, log) if log.draws else None
    watched = GuardedWorld(world, arm, log, highest_raw, display.follow if display else None)
    checkpoints = Checkpoints(keep, world, log, out)
    results: dict[type, object] = {}
    between = between or _nothing
    if begun is not None:
        _go_on(begun, watched, log, out)
        results |= copy.deepcopy(begun.results)  # so that no stage can change those of another run
    for number, (name, stage) in enumerate(stages.items(), 1):
        if begun is not None and number <= begun.stages:
            continue
        between("before", name, watched, log)
        if display is not None:
            display.begin()
        rng = np.random.default_rng([seed, zlib.crc32(name.encode())])
        with log.stage(name, lambda: watched.t_ns) as close:
            result = stage.run(Context(watched, log, rng, out, results))
            close(result)
        results[result_type(stage)] = result
        between("after", name, watched, log)
        if number < len(stages):
            checkpoints.take(number, watched, results)
    return results


def _nothing(moment: str, stage: str, world: GuardedWorld, log: RunLog) -> None:
    """A run without a protocol."""


def _go_on(begun: Checkpoint, watched: GuardedWorld, log: RunLog, out: Path) -> None:
    """Bring log and files to where a checkpoint was taken."""
    watched.resume(begun.goal, begun.gas)
    log.repeat(begun.journal)
    for name, data in begun.files.items():
        (out / name).write_bytes(data)
