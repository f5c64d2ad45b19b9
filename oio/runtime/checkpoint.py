"""A run after some of its stages: all that the rest needs to go on as if nothing had been between."""

import copy
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TypeGuard, runtime_checkable

from oio.core.interfaces import World
from oio.core.records import Array
from oio.core.seeds import Seeds
from oio.log import Journal, RunLog
from oio.runtime.gas_stream import GasStream
from oio.runtime.guarded_world import GuardedWorld


@runtime_checkable
class Resumable(Protocol):
    """Optional protocol of a backend whose worlds can be copied: simulations."""

    @property
    def can_resume(self) -> bool:
        """Whether all parts are known to be copied whole; those of plug-ins may hold what is not."""
        ...

    def resume(self, world: World) -> AbstractContextManager[World]:
        """Make a copy of a world live, which goes on from there to the last bit as that world would."""
        ...


@runtime_checkable
class Renewable(Protocol):
    """Optional protocol of a backend on whose worlds one search after another can begin: simulations."""

    def renewed(self, world: World, seeds: Seeds | None) -> World:
        """Return a copy of a world, at rest until it is `attended`; `seeds`: with source, turbulence and noise drawn anew from them."""
        ...

    def attended(self, world: World) -> AbstractContextManager[World]:
        """A world goes on within this context, which may be entered again and again."""
        ...


def resumable(backend: object) -> TypeGuard[Resumable]:
    """Whether worlds of a backend can be copied."""
    return isinstance(backend, Resumable) and backend.can_resume


@dataclass(frozen=True, slots=True, eq=False)
class Checkpoint:
    """What a run was after its first `stages` stages: a copy of the world, the goal of the arm, the gas that has
    arrived, the results, the log, and files."""

    stages: int
    world: World
    goal: Array
    gas: GasStream
    results: Mapping[type, object]
    journal: Journal
    files: Mapping[str, bytes]


Keep = Callable[[Checkpoint], None]


class Checkpoints:
    """Takes the checkpoints of one run, whose files go to `out`."""

    def __init__(self, keep: Keep | None, world: World, log: RunLog, out: Path) -> None:
        self._keep, self._world, self._log, self._out = keep, world, log, out
        self._before = {path.name for path in out.iterdir()} if keep else set()
        if keep:
            log.remember()

    def take(self, stages: int, watched: GuardedWorld, results: Mapping[type, object]) -> None:
        """Take one, if they are kept."""
        if self._keep is None:
            return
        files = {path.name: path.read_bytes() for path in sorted(self._out.iterdir()) if path.name not in self._before}
        self._keep(
            Checkpoint(
                stages,
                copy.deepcopy(self._world),
                watched.goal,
                copy.deepcopy(watched.gas),
                copy.deepcopy(dict(results)),
                self._log.remembered(),
                files,
            )
        )
