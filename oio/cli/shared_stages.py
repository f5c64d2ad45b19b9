"""Stages that runs have in common: runs that differ in later stages alone, such as filters over one truth, are calibrated once."""

from contextlib import AbstractContextManager

from oio.cli.experiment import Experiment
from oio.core.interfaces import World
from oio.runtime.checkpoint import Checkpoint, resumable


class SharedStages:
    """Checkpoints of the last run in this process. Stages are the same if they are the same objects, which are frozen: see `build`."""

    def __init__(self) -> None:
        self._last: Experiment | None = None
        self._checkpoints: list[Checkpoint] = []

    def begin(self, experiment: Experiment) -> Checkpoint | None:
        """Return where a run can begin, after the stages that it has in common with the last one; None: at its beginning."""
        common = self._common(experiment)
        self._last, self._checkpoints = experiment, [c for c in self._checkpoints if c.stages <= common]
        return self._checkpoints[-1] if self._checkpoints else None

    def _common(self, experiment: Experiment) -> int:
        last = self._last
        if last is None or not _same_world(last, experiment):
            return 0
        stages, before = list(experiment.stages.items()), list(last.stages.items())
        same = [a[0] == b[0] and a[1] is b[1] for a, b in zip(stages, before, strict=False)]
        return min((*(i for i, equal in enumerate(same) if not equal), len(same), len(stages) - 1))

    def keep(self, checkpoint: Checkpoint) -> None:
        """Keep a checkpoint of the run that has begun."""
        self._checkpoints.append(checkpoint)


def opened(experiment: Experiment, begun: Checkpoint | None) -> AbstractContextManager[World]:
    """Return the world of a run: a new one, or a copy of that of a checkpoint."""
    if begun is None:
        return experiment.backend.open()
    backend = experiment.backend
    assert resumable(backend)
    return backend.resume(begun.world)


def _same_world(a: Experiment, b: Experiment) -> bool:
    parts = ((a.backend, b.backend), (a.arm, b.arm), (a.sensor, b.sensor))
    return resumable(b.backend) and all(x is y for x, y in parts) and (a.seed, a.logged) == (b.seed, b.logged)
