"""A sliding-window smoother: the last readings stay open, their steps linearised anew whenever a reading tells more of them."""

from oio.core.records import Belief, GasReading, Innovation, JointState
from oio.core.settings import in_range, settings
from oio.estimators.smoothing_window import Window
from oio.inference.state_space import StateSpace


@settings
class FixedLag:
    """A window of some readings (see `oio.estimators.smoothing_window`); with one reading it is the iterated filter."""

    gate_nis: float  # a reading whose NIS is larger is not used (chi-square, 1 degree of freedom)
    readings: int  # in the window; the oldest goes into the anchor
    iterations: int  # at most, per reading
    settled_sigmas: float  # the states of the window moved by less: enough
    steps: int  # of the arm in one window; when there are more, the window is begun anew

    def check(self) -> None:
        """Refuse a gate that lets nothing pass, and no window."""
        in_range(self, gate_nis=(1.0, 1e9), readings=(1, 10_000), iterations=(1, 100), settled_sigmas=(0.0, 10.0), steps=(1, 100_000))

    @property
    def _window(self) -> Window:
        return Window(self.readings, self.steps, self.iterations, self.settled_sigmas)

    def predict(self, model: StateSpace, belief: Belief, joints: JointState) -> Belief:
        """Propagate to the time of `joints`."""
        return self._window.predict(model, belief, joints)

    def update(self, model: StateSpace, belief: Belief, reading: GasReading) -> tuple[Belief, Innovation]:
        """Condition on one reading taken now."""
        return self._window.update(model, belief, reading, self.gate_nis)
