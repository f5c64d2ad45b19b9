"""What a filter must offer: `Estimator`, and `Initializer` for those that start from all hypotheses of a belief map."""

from typing import Protocol, runtime_checkable

from oio.core.records import Belief, GasReading, Innovation, JointState
from oio.inference.map_fit import Fit
from oio.inference.state_space import StateSpace


@runtime_checkable
class Estimator(Protocol):
    """A filter: immutable, its state goes in and comes out."""

    def predict(self, model: StateSpace, belief: Belief, joints: JointState) -> Belief:
        """Propagate the belief to the time of `joints`; the nose moved along the arm's kinematics."""
        ...

    def update(self, model: StateSpace, belief: Belief, reading: GasReading) -> tuple[Belief, Innovation]:
        """Condition the belief on one reading taken now; a gated reading leaves the belief as it was."""
        ...


@runtime_checkable
class Initializer(Protocol):
    """What a filter may have besides, if it begins from more than the best hypothesis of the belief map."""

    def begin(self, model: StateSpace, fits: tuple[Fit, ...], t_ns: int, measurements: int) -> Belief:
        """The belief at t_ns of the hypotheses, best first, of a map of so many measurements."""
        ...
