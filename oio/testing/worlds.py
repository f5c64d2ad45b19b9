"""Suite for backends."""

from typing import Any, cast

import numpy as np

from oio.arm import Arm
from oio.log import RunLog
from oio.pipeline import Watched
from oio.protocols import Backend, World
from oio.records import GasSample, JointState, WorldSample, nanoseconds
from oio.testing.promises import bits, frozen, promise, refused


class _Nowhere:
    """A log that keeps nothing."""

    def write(self, record: object) -> None:
        """Forget the record."""


def check_backend(backend: Backend, for_s: float = 1.0) -> None:
    """Time runs on, samples come in its order, a second opening gives the same, unknown sources and NaN commands are refused.

    `for_s` must be long enough for joints and gas to come in. A backend with a field `arm` is sent a NaN as a stage would send it.
    """
    frozen(backend)
    with backend.open() as world:
        first = _run(world, for_s)
        refused("a source that the world does not have", world.present, "no such source")
        arm = getattr(backend, "arm", None)
        if isinstance(arm, Arm):
            _check_command(world, arm, for_s)
    with backend.open() as world:
        second = _run(world, for_s)
    promise([bits(s) for s in first] == [bits(s) for s in second], "a backend opened again gives the same samples, bit for bit.")


def _run(world: World, for_s: float) -> list[WorldSample]:
    began_ns = world.t_ns
    promise(began_ns >= 0, f"time begins at 0 ns or later, not at {began_ns}.")
    world.present("none")
    seen = list(_in_order(world, 0.0, began_ns))
    promise(world.t_ns - began_ns <= nanoseconds(for_s) // 2, "samples(0) lets no time pass.")
    seen += _in_order(world, for_s, seen[-1].t_ns if seen else began_ns)
    promise(world.t_ns > began_ns, f"samples({for_s}) lets time pass.")
    promise(world.t_ns <= began_ns + nanoseconds(for_s), f"samples({for_s}) lets no more time pass than that.")
    promise(any(isinstance(s, JointState) for s in seen), f"joints come in within {for_s} s; else check with a longer for_s.")
    promise(any(isinstance(s, GasSample) for s in seen), f"gas comes in within {for_s} s; else check with a longer for_s.")
    return seen


def _in_order(world: World, for_s: float, last_ns: int) -> list[WorldSample]:
    """The samples of a span that begins not before last_ns."""
    seen: list[WorldSample] = []
    for sample in world.samples(for_s):
        promise(sample.t_ns >= last_ns, f"samples come in time order: {sample.t_ns} ns after {last_ns} ns.")
        promise(sample.t_ns <= world.t_ns, f"no sample is of the future: {sample.t_ns} ns at {world.t_ns} ns.")
        if isinstance(sample, JointState):
            promise(all(bool(np.all(np.isfinite(x))) for x in (sample.q, sample.dq, sample.ddq)), "joints are finite.")
        last_ns = sample.t_ns
        seen.append(sample)
    return seen


def _check_command(world: World, arm: Arm, for_s: float) -> None:
    watched = Watched(world, arm, cast(RunLog, _Nowhere()))
    nothing: Any = np.full(arm.dof, np.nan)
    refused("a move to NaN", watched.move, nothing)
    seen = _in_order(world, for_s, world.t_ns)  # whose joints are finite
    lengths = {len(s.q) for s in seen if isinstance(s, JointState)}
    promise(lengths == {arm.dof}, f"joints have the {arm.dof} unlocked ones of the arm, not {sorted(lengths)}.")
