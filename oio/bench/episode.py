"""A simulated bench after some stages of a run, on which episodes begin; made once per process and kept."""

import copy
import functools
import tempfile
import zlib
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from oio.api.array_input import expected
from oio.api.setup import Setup, in_one_paragraph
from oio.bench.trial import experiment
from oio.cli.experiment import Experiment
from oio.core.errors import BadInput
from oio.core.interfaces import World
from oio.core.records import Array, Truth, WorldSample
from oio.core.seeds import Seeds
from oio.log import MemoryLog, RunLog
from oio.runtime.checkpoint import Renewable
from oio.runtime.context import Context
from oio.runtime.gas_stream import GasStream
from oio.runtime.guarded_world import GuardedWorld
from oio.runtime.runner import run_stages

KEPT = 32  # benches of a process


@dataclass(frozen=True, eq=False)
class Bench:
    """What a run was before its stage `until`: a copy of the world, the goal of the arm, the gas that arrived, the results."""

    experiment: Experiment
    until: str
    world: World
    goal: Array
    gas: GasStream
    results: Mapping[type, object]

    @property
    def backend(self) -> Renewable:
        """The simulation. Raises BadInput for a backend whose worlds cannot be copied."""
        backend = self.experiment.backend
        if not isinstance(backend, Renewable):
            raise BadInput("the backend is not simulated, but episodes begin on copies of one bench. Leave backend= out.")
        return backend


class TruthLog(MemoryLog):
    """Log of an episode: it keeps the latest truth, for rewards, and nothing else."""

    truth: Truth | None = None

    def write(self, sample: WorldSample) -> None:
        """Keep the truth."""
        if isinstance(sample, Truth):
            self.truth = sample


class Episode:
    """A copy of a bench that goes on, within `attended` alone. `seeds`: source, turbulence and noise drawn anew from them."""

    def __init__(self, bench: Bench, seeds: Seeds | None, seed: int) -> None:
        built = bench.experiment
        self._backend, self._world, self.log = bench.backend, bench.backend.renewed(bench.world, seeds), TruthLog()
        self.guarded = GuardedWorld(self._world, built.arm, self.log, built.sensor.highest_raw)
        self.guarded.resume(bench.goal, bench.gas)
        rng = np.random.default_rng([seed, zlib.crc32(bench.until.encode())])  # as a stage of that name has it
        self.context = Context(self.guarded, self.log, rng, Path(), bench.results)

    def attended(self) -> AbstractContextManager[World]:
        """The world goes on within this context."""
        return self._backend.attended(self._world)

    def permitted(self, goal: Array) -> Array:
        """The goal (n,) rad, or that of the last move if the arm has no path to it."""
        try:
            self.guarded.move_s(self.guarded.goal if not np.all(np.isfinite(goal)) else goal)
        except BadInput:
            return self.guarded.goal
        return goal


def words_of(
    sensor: str, dof: int, air: str, arm: str, profile: str, overrides: Mapping[str, object] | None
) -> tuple[str, ...]:  # fmt: skip
    """Words of the command line, checked: all is built once. Raises BadInput in one paragraph for what is wrong, and for a seed: episodes
    have their own."""
    expected("overrides", overrides, Mapping, "{'stage.navigate.max_moves': 40}", optional=True)
    own = [key for key in overrides or {} if key in ("seed", "backend", "stage") or key.startswith("seeds.")]
    if own:
        raise BadInput(f"overrides has {own[0]}, but an environment sets it itself. Give seeds to reset, and leave {own[0]} out.")
    words = tuple(Setup(sensor, dof, arm, profile, {"air": air, **(overrides or {})}).words)
    with in_one_paragraph():
        experiment(words, 0)
    return words


def made(words: tuple[str, ...], seed: int, until: str) -> Bench:
    """Run the stages before `until` with these words and this seed; takes some seconds."""
    with in_one_paragraph():
        built = experiment(words, seed)
    names = list(built.stages)
    stages = {name: built.stages[name] for name in names[: names.index(until)]}
    watched: list[GuardedWorld] = []

    def noted(moment: str, stage: str, world: GuardedWorld, log: RunLog) -> None:
        watched[:] = [world]

    with tempfile.TemporaryDirectory() as folder, built.backend.open() as world:
        results = run_stages(stages, world, built.arm, MemoryLog(), Path(folder), seed, built.sensor.highest_raw, between=noted)
        return Bench(built, until, copy.deepcopy(world), watched[0].goal, watched[0].gas, results)


kept = functools.lru_cache(maxsize=KEPT)(made)


def checked_benches(seeds: Sequence[int] | None) -> tuple[int, ...] | None:
    """The seeds of the benches that are kept, or None for a new one in every episode. Raises BadInput for what is no list of seeds."""
    if seeds is None:
        return None
    listed = isinstance(seeds, Sequence | np.ndarray) and not isinstance(seeds, str)
    if not listed or any(isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0 for seed in seeds):
        raise BadInput(f"bench_seeds is {seeds!r}, but it is a list of whole numbers from 0 on, or None. Type bench_seeds=(0, 1, 2, 3).")
    if not len(seeds):
        raise BadInput("bench_seeds is empty, but an episode needs a bench. Give a seed, or None for a new bench in every episode.")
    return tuple(int(seed) for seed in seeds)


def begun(words: tuple[str, ...], bench_seeds: Sequence[int] | None, number: int, until: str) -> tuple[Bench, Episode]:
    """Begin an episode: on one of the kept benches, with source, turbulence and noise of `number`; or, without any, on a new bench."""
    if bench_seeds is None:
        bench = made(words, number, until)
        return bench, Episode(bench, None, number)
    bench = kept(words, bench_seeds[number % len(bench_seeds)], until)
    return bench, Episode(bench, Seeds(truth=number, disturbance=number, measurement=number), number)


def world_seed(options: Mapping[str, Any] | None, drawn: int) -> int:
    """The seed of an episode: that in the options of `reset`, else the one that was drawn. Raises BadInput for other options."""
    unknown = sorted({*(options or {})} - {"world_seed"})
    if unknown:
        raise BadInput(f"reset was given the option {unknown[0]}, but it knows world_seed alone. Type reset(options={{'world_seed': 7}}).")
    given = (options or {}).get("world_seed", drawn)
    if not isinstance(given, int | np.integer) or isinstance(given, bool) or given < 0:
        raise BadInput(f"world_seed is {given!r}, but it is a whole number, 0 or more. Type reset(options={{'world_seed': 7}}).")
    return int(given)
