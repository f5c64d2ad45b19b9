"""What a person wants to see of a run while it goes on, gathered from the entries of its log."""

from dataclasses import dataclass, field

import numpy as np

from oio.cli.signal_history import SignalHistory
from oio.core.records import Event, GasReading, JointState
from oio.log import BeliefScene, Entry, Progress, StageMark


@dataclass
class StageState:
    """A stage: `begin`, `end` or `failed`, when it last said something [ns], what it waits for, and its figure."""

    state: str
    t_ns: int
    waits_for: str = ""
    figure: str = ""

    @property
    def told(self) -> str:
        """What it waits for, and its figure."""
        return ", ".join(filter(None, (self.waits_for, self.figure)))


@dataclass
class RunState:
    """Stages, signals by element, moves, and the place of the source [m] with its standard deviation [m]."""

    stages: dict[str, StageState] = field(default_factory=dict)
    signals: dict[int, SignalHistory] = field(default_factory=dict)
    moves: int = 0
    source: tuple[tuple[float, ...], float] | None = None

    def take(self, entry: Entry) -> None:
        """Take up one entry."""
        if type(entry) is JointState:
            return  # most entries are, and it costs nothing to say so first
        match entry:
            case GasReading(element=element):
                self.signals.setdefault(element, SignalHistory()).add(entry)
            case Event(kind="move"):
                self.moves += 1
            case Event(kind="present"):
                self.source = None  # what is believed is of the source that was open before
            case StageMark(t_ns=t_ns, stage=stage, state=state):
                self._mark(stage, state, t_ns)
            case Progress(t_ns=t_ns, stage=stage):
                self.stages[stage] = StageState("begin", t_ns, entry.waits_for, entry.figure)
            case BeliefScene(hypotheses=[(mean, cov), *_]):
                self.source = tuple(mean.tolist()), float(np.sqrt(np.trace(cov)))

    def _mark(self, stage: str, state: str, t_ns: int) -> None:
        if state == "begin":
            self.stages[stage] = StageState(state, t_ns)
        else:
            self.stages[stage].state, self.stages[stage].t_ns = state, t_ns
