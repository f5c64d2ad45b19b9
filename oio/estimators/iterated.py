"""The iterated extended Kalman filter: the steps since the last reading are linearised anew about what the next one tells of them."""

from oio.core.records import Belief, GasReading, Innovation, JointState
from oio.core.settings import in_range, settings
from oio.estimators.smoothing_window import Window
from oio.inference.state_space import StateSpace


@settings
class Iterated:
    """A window of one reading (see `oio.estimators.smoothing_window`); with one iteration it is the extended Kalman filter."""

    gate_nis: float  # a reading whose NIS is larger is not used (chi-square, 1 degree of freedom)
    iterations: int  # at most
    settled_sigmas: float  # the states of the window moved by less: enough
    steps: int  # of the arm in one window; when there are more, the window is begun anew

    def check(self) -> None:
        """Refuse a gate that lets nothing pass, and no iteration."""
        in_range(self, gate_nis=(1.0, 1e9), iterations=(1, 100), settled_sigmas=(0.0, 10.0), steps=(1, 100_000))

    @property
    def _window(self) -> Window:
        return Window(1, self.steps, self.iterations, self.settled_sigmas)

    def predict(self, model: StateSpace, belief: Belief, joints: JointState) -> Belief:
        """Propagate to the time of `joints`."""
        return self._window.predict(model, belief, joints)

    def update(self, model: StateSpace, belief: Belief, reading: GasReading) -> tuple[Belief, Innovation]:
        """Condition on one reading taken now."""
        return self._window.update(model, belief, reading, self.gate_nis)
