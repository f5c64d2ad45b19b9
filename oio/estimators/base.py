"""Filter protocols: `Estimator` (predict, update), and `Initializer` for filters that start from all hypotheses of a belief map."""

from typing import Protocol, runtime_checkable

from oio.core.records import Belief, GasReading, Innovation, JointState
from oio.inference.map_fit import Fit
from oio.inference.state_space import StateSpace


@runtime_checkable
class Estimator(Protocol):
    """Recursive filter, immutable: its state is passed in and returned."""

    def predict(self, model: StateSpace, belief: Belief, joints: JointState) -> Belief:
        """Time update: propagate the belief to the time of `joints`; the nose follows from the forward kinematics."""
        ...

    def update(self, model: StateSpace, belief: Belief, reading: GasReading) -> tuple[Belief, Innovation]:
        """Measurement update: condition the belief on one reading taken now; a gated reading leaves the belief unchanged."""
        ...


@runtime_checkable
class Initializer(Protocol):
    """Optional protocol of a filter that is initialised from more than the best hypothesis of the belief map."""

    def begin(self, model: StateSpace, fits: tuple[Fit, ...], t_ns: int, measurements: int) -> Belief:
        """Return the initial belief at t_ns from the hypotheses `fits`, best first, of a map made of so many measurements."""
        ...
