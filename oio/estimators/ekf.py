"""Extended Kalman filter with lag, drift and fluctuation in its state; update in Joseph form (Bucy & Joseph 1968)."""

from typing import Annotated

from oio.core.records import Belief, GasReading, Innovation, JointState
from oio.core.settings import Within, settings
from oio.estimators.gated_update import gated_update
from oio.estimators.propagation import predict
from oio.inference.state_space import StateSpace


@settings
class Ekf:
    """Extended Kalman filter. predict: x = f(x), P = F P F' + Q; update: Joseph form."""

    gate_nis: Annotated[float, Within(1, 1e9)]  # a reading whose NIS is larger is not used (chi-square, 1 degree of freedom)

    def predict(self, model: StateSpace, belief: Belief, joints: JointState) -> Belief:
        """Time update: propagate the belief to the time of `joints`."""
        return predict(model, belief, joints)

    def update(self, model: StateSpace, belief: Belief, reading: GasReading) -> tuple[Belief, Innovation]:
        """Measurement update: condition the belief on one reading taken now."""
        return gated_update(model, belief, reading, self.gate_nis)
