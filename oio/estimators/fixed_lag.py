"""Fixed-lag (sliding-window) smoother: the transitions of the latest readings are relinearised with every new reading."""

from typing import Annotated

from oio.core.records import Belief, GasReading, Innovation, JointState
from oio.core.settings import Within, settings
from oio.estimators.smoothing_window import Window
from oio.inference.state_space import StateSpace


@settings
class FixedLag:
    """Fixed-lag smoother over a window of readings (see `oio.estimators.smoothing_window`); one reading: the iterated EKF."""

    gate_nis: Annotated[float, Within(1, 1e9)]  # a reading whose NIS is larger is not used (chi-square, 1 degree of freedom)
    readings: Annotated[int, Within(1, 10_000)]  # window length; the oldest reading is absorbed into the anchor belief
    iterations: Annotated[int, Within(1, 100)]  # maximum Gauss-Newton iterations per reading
    # convergence_sigmas: convergence: the largest change of a window state, in standard deviations, is below this
    convergence_sigmas: Annotated[float, Within(0, 10)]
    steps: Annotated[int, Within(1, 100_000)]  # maximum arm steps in one window; a full window is restarted

    @property
    def _window(self) -> Window:
        return Window(self.readings, self.steps, self.iterations, self.convergence_sigmas)

    def predict(self, model: StateSpace, belief: Belief, joints: JointState) -> Belief:
        """Time update: propagate the belief to the time of `joints`."""
        return self._window.predict(model, belief, joints)

    def update(self, model: StateSpace, belief: Belief, reading: GasReading) -> tuple[Belief, Innovation]:
        """Measurement update: condition the belief on one reading taken now."""
        return self._window.update(model, belief, reading, self.gate_nis)
