"""Olfactory inertial odometry: joint states and gas readings in, beliefs of source and nose out.

The same object runs live, on replay, and over the log in the stage `evaluate`.
"""

from collections import deque
from dataclasses import replace

from oio.core.records import SECOND_NS, Array, Belief, GasReading, Innovation, JointState
from oio.estimators.base import Estimator, Initializer
from oio.gas.timing import JointDelayLine
from oio.inference.base import Localizer
from oio.inference.initial_belief import initial_belief
from oio.inference.map_fit import Fit
from oio.inference.prior import Prior
from oio.inference.state_space import StateSpace

NIS_WINDOW, NIS_LEAST = 30, 10  # readings
UNINFORMATIVE_PPM = 1e6  # standard uncertainty of a reading that no gate refuses


class Odometry:
    """Records a trace until `locate` has fitted a belief map to it; from then on the filter runs."""

    def __init__(self, estimator: Estimator, prior: Prior, belief_map: Localizer) -> None:
        self.prior, self._estimator, self._map = prior, estimator, belief_map
        self.model = prior.model  # that of the world which the best hypothesis assumes
        self.trace = belief_map.trace()
        self.hypotheses: tuple[Fit, ...] = ()
        self.belief: Belief | None = None
        self._delay_line = JointDelayLine(prior.delay_s)
        self._joints: JointState | None = None  # the latest
        self._fed: JointState | None = None  # the last that reached the filter
        self._nis = deque[float](maxlen=NIS_WINDOW)

    def joints(self, state: JointState) -> None:
        """Predict to the time of a joint state (by the delay of the gas stamps later)."""
        self._joints = state
        for due in self._delay_line.joints(state):
            self._feed(due)

    def reading(self, reading: GasReading) -> Innovation | None:
        """Update with a reading; its innovation, or None before the first map. A missed reading is neither recorded nor counted."""
        for due in self._delay_line.reading(reading):
            self._feed(due)
        if not reading.missed:
            self.trace.reading(reading)
        if self.belief is None:
            return None
        self.belief, innovation = self._estimator.update(self.model, self.belief, reading)
        if not reading.missed:  # its innovation is gated and zero, and would make the filter look consistent
            self._nis.append(innovation.nis)
        return innovation

    def locate(self, measurements: int, made: tuple[Fit, ...] = (), thorough: bool = True) -> tuple[Fit, ...]:
        """Fit the belief map to the whole trace of so many measurements, and restart the filter from its best hypothesis.

        `made` is the result of this very fit if it is known, as it is when the log of a search is scored again.
        """
        assert self._fed is not None
        self.hypotheses = made or self._map.locate(self.trace.as_arrays(), self.prior, self.hypotheses, thorough)
        self.model = self.prior.model.after(self.hypotheses[0])
        begin = self._estimator.begin if isinstance(self._estimator, Initializer) else begin_from_best
        self.belief = begin(self.model, self.hypotheses, self._fed.t_ns, measurements)
        self._rehearse(self.belief, self._fed)
        return self.hypotheses

    def _rehearse(self, belief: Belief, state: JointState) -> None:
        """Run one step of the filter and discard it: after an install that compiles it for up to 20 s, while the arm stands still."""
        model, then = self.model, replace(state, t_ns=state.t_ns + SECOND_NS)
        belief = self._estimator.predict(model, belief, then)
        self._estimator.update(model, belief, GasReading(then.t_ns, 0, 0.0, UNINFORMATIVE_PPM))
        model.nose(belief, then)

    def _feed(self, state: JointState) -> None:
        self._fed = state
        self.trace.joints(state)
        if self.belief is not None and state.t_ns > self.belief.t_ns:
            self.belief = self._estimator.predict(self.model, self.belief, state)

    def mean_nis(self) -> float | None:
        """Mean NIS of the latest NIS_WINDOW readings, None for fewer than NIS_LEAST. A map does not empty the window: that it explains the
        readings which contradicted the belief before it is no evidence that it foresees the next."""
        return sum(self._nis) / len(self._nis) if len(self._nis) >= NIS_LEAST else None

    def consistent(self, limit: float) -> bool:
        """Whether nothing speaks against the filter: the mean NIS is below `limit`, or there are too few readings to tell."""
        mean = self.mean_nis()
        return mean is None or mean < limit

    def verified(self, limit: float) -> bool:
        """Whether readings speak for the filter: there are enough of them, and their mean NIS is below `limit`."""
        mean = self.mean_nis()
        return mean is not None and mean < limit

    def nose(self) -> tuple[Array, Array] | None:
        """Believed nose position (3,) m and its covariance (3, 3) m^2; None before the first map."""
        if self.belief is None or self._joints is None:
            return None
        return self.model.nose(self.belief, self._joints)

    def source(self) -> tuple[Array, Array] | None:
        """Believed source (3,) m and its covariance (3, 3) m^2; None before the first map."""
        if self.belief is None:
            return None
        s = self.model.at["s"]
        return self.belief.mean[s], self.belief.cov[s, s]


def begin_from_best(model: StateSpace, fits: tuple[Fit, ...], t_ns: int, measurements: int) -> Belief:
    """The initial belief of a filter that is no `Initializer`: that of the best hypothesis."""
    return initial_belief(model, fits[0], t_ns, measurements)
