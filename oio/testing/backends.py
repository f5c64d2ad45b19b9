"""Conformance tests of backends."""

import dataclasses
import time
from typing import Any, cast

import numpy as np

from oio.core.interfaces import Backend, World
from oio.core.records import GasSample, JointState, WorldSample, nanoseconds
from oio.kinematics.arm import Arm
from oio.log import RunLog
from oio.runtime.guarded_world import GuardedWorld
from oio.testing.assertions import bitwise, require, require_bad_input, require_frozen


class _NullLog:
    """Null log: keeps nothing."""

    def write(self, record: object) -> None:
        """Discard the record."""


def check_backend(backend: Backend, for_s: float = 1.0) -> None:
    """Check a backend: monotonic time, samples in time order, repeatable when reopened, unknown sources and NaN commands refused.

    `for_s` must be long enough for joint states and gas samples to arrive. A backend with an `Arm` among its fields is sent a NaN move as a
    stage would send it. For a bench in real time there is `check_live_backend`.
    """
    require_frozen(backend)
    with backend.open() as world:
        first = _run(world, for_s)
        _check_refusals(backend, world, for_s)
    with backend.open() as world:
        second = _run(world, for_s)
    require([bitwise(s) for s in first] == [bitwise(s) for s in second], "a backend opened again gives the same samples, bit for bit.")


def check_live_backend(backend: Backend, for_s: float = 1.0, away_s: float = 0.5) -> None:
    """Check a bench in real time: as `check_backend`, but its time goes on between calls, and no two runs are the same.

    Samples of the `away_s` seconds of host time in which the caller does not poll arrive with the next call; after closing, the backend can
    be opened again.
    """
    require_frozen(backend)
    with backend.open() as world:
        last_ns = _sensed(world, for_s)[-1].t_ns
        time.sleep(away_s)
        meanwhile = [s for s in _in_order(world, 0.0, last_ns) if isinstance(s, JointState)]
        require(len(meanwhile) > 0, f"joints that were sensed in {away_s} s while nobody asked come with the next span.")
        _check_refusals(backend, world, for_s)
    with backend.open() as world:
        _sensed(world, for_s)


def _check_refusals(backend: Backend, world: World, for_s: float) -> None:
    require_bad_input("a source that the world does not have", world.present, "no such source")
    arms = [field for key in dataclasses.fields(cast(Any, backend)) if isinstance(field := getattr(backend, key.name), Arm)]
    for arm in arms:
        _check_command(world, arm, for_s)


def _run(world: World, for_s: float) -> list[WorldSample]:
    """Samples of a simulated world, whose time passes only while samples are requested."""
    began_ns = world.t_ns
    world.present("none")
    seen = list(_in_order(world, 0.0, began_ns))
    require(world.t_ns - began_ns <= nanoseconds(for_s) // 2, "samples(0) lets no time pass.")
    seen += _sensed(world, for_s)
    require(world.t_ns <= began_ns + nanoseconds(for_s), f"samples({for_s}) lets no more time pass than that.")
    return seen


def _sensed(world: World, for_s: float) -> list[WorldSample]:
    """Samples of a time span, which must contain joint states and gas samples."""
    began_ns = world.t_ns
    require(began_ns >= 0, f"time begins at 0 ns or later, not at {began_ns}.")
    world.present("none")
    seen = list(_in_order(world, for_s, began_ns))
    require(world.t_ns > began_ns, f"samples({for_s}) lets time pass.")
    require(any(isinstance(s, JointState) for s in seen), f"joints come in within {for_s} s; else check with a longer for_s.")
    require(any(isinstance(s, GasSample) for s in seen), f"gas comes in within {for_s} s; else check with a longer for_s.")
    return seen


def _in_order(world: World, for_s: float, last_ns: int) -> list[WorldSample]:
    """Samples of a time span in order, none before last_ns."""
    seen: list[WorldSample] = []
    for sample in world.samples(for_s):
        require(sample.t_ns >= last_ns, f"samples come in time order: {sample.t_ns} ns after {last_ns} ns.")
        require(sample.t_ns <= world.t_ns, f"no sample is of the future: {sample.t_ns} ns at {world.t_ns} ns.")
        if isinstance(sample, JointState):
            require(all(bool(np.all(np.isfinite(x))) for x in (sample.q, sample.dq, sample.ddq)), "joints are finite.")
        last_ns = sample.t_ns
        seen.append(sample)
    return seen


def _check_command(world: World, arm: Arm, for_s: float) -> None:
    watched = GuardedWorld(world, arm, cast(RunLog, _NullLog()))
    nothing: Any = np.full(arm.dof, np.nan)
    require_bad_input("a move to NaN", watched.move, nothing)
    seen = _in_order(world, for_s, world.t_ns)  # whose joints are finite
    lengths = {len(s.q) for s in seen if isinstance(s, JointState)}
    require(lengths == {arm.dof}, f"joints have the {arm.dof} unlocked ones of the arm, not {sorted(lengths)}.")
