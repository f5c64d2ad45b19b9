"""Olfactory inertial odometry: joints and readings in, beliefs out; the same object live, on replay, and over the log in `evaluate`."""

from dataclasses import replace

from oio.core.records import SECOND_NS, Array, Belief, GasReading, Innovation, JointState
from oio.estimators.base import Estimator, Initializer
from oio.gas.timing import JointDelayLine
from oio.inference.belief_map import BeliefMap
from oio.inference.map_fit import Fit
from oio.inference.prior import Prior
from oio.inference.state_space import StateSpace

UNINFORMATIVE_PPM = 1e6  # standard uncertainty of a reading that no gate refuses


class Odometry:
    """Gathers a trace until `locate` has made a belief map of it; from then on the filter runs."""

    def __init__(self, estimator: Estimator, prior: Prior, belief_map: BeliefMap) -> None:
        self.prior, self._estimator, self._map = prior, estimator, belief_map
        self.trace = belief_map.trace()
        self.hypotheses: tuple[Fit, ...] = ()
        self.belief: Belief | None = None
        self._held = JointDelayLine(prior.delay_s)
        self._joints: JointState | None = None  # the latest
        self._fed: JointState | None = None  # where the nose was when the gas of now was taken
        self._nis: list[float] = []

    def joints(self, state: JointState) -> None:
        """The arm is here now."""
        self._joints = state
        for due in self._held.joints(state):
            self._feed(due)

    def reading(self, reading: GasReading) -> Innovation | None:
        """A reading, taken at the time of the last joints, or the delay before; None before the first map. A missed one is neither kept nor
        counted."""
        for due in self._held.reading(reading):
            self._feed(due)
        if not reading.missed:
            self.trace.reading(reading)
        if self.belief is None:
            return None
        self.belief, innovation = self._estimator.update(self.prior.model, self.belief, reading)
        if not reading.missed:  # its innovation is gated and zero: a sensor that falls silent is no consistent filter
            self._nis = [*self._nis[-49:], innovation.nis]
        return innovation

    def locate(self, measurements: int, made: tuple[Fit, ...] = ()) -> tuple[Fit, ...]:
        """Make the map of the whole trace, so many measurements, and begin the filter anew from its best hypothesis.

        `made` is this very map, if it was made before: the same odometry run again over the log need not make it twice.
        """
        assert self._fed is not None
        self.hypotheses = made or self._map.locate(self.trace.frozen(), self.prior, self.hypotheses)
        begin = self._estimator.begin if isinstance(self._estimator, Initializer) else begin_from_best
        self.belief = begin(self.prior.model, self.hypotheses, self._fed.t_ns, measurements)
        self._nis = []
        self._rehearse(self.belief, self._fed)
        return self.hypotheses

    def _rehearse(self, belief: Belief, state: JointState) -> None:
        """One step of the filter, thrown away. After an install its first step is compiled, for as long as 20 s: now the arm stands."""
        model, then = self.prior.model, replace(state, t_ns=state.t_ns + SECOND_NS)
        belief = self._estimator.predict(model, belief, then)
        self._estimator.update(model, belief, GasReading(then.t_ns, 0, 0.0, UNINFORMATIVE_PPM))
        model.nose(belief, then)

    def _feed(self, state: JointState) -> None:
        self._fed = state
        self.trace.joints(state)
        if self.belief is not None and state.t_ns > self.belief.t_ns:
            self.belief = self._estimator.predict(self.prior.model, self.belief, state)

    def consistent(self, limit: float) -> bool:
        """Whether the mean NIS of the latest readings (at least ten) is below `limit`; too few say nothing."""
        return len(self._nis) < 10 or sum(self._nis) / len(self._nis) < limit

    def nose(self) -> tuple[Array, Array] | None:
        """Believed nose position (3,) m and its covariance (3, 3) m^2; None before the first map."""
        if self.belief is None or self._joints is None:
            return None
        return self.prior.model.nose(self.belief, self._joints)

    def source(self) -> tuple[Array, Array] | None:
        """Believed source (3,) m and its covariance (3, 3) m^2; None before the first map."""
        if self.belief is None:
            return None
        s = self.prior.model.at["s"]
        return self.belief.mean[s], self.belief.cov[s, s]


def begin_from_best(model: StateSpace, fits: tuple[Fit, ...], t_ns: int, measurements: int) -> Belief:
    """How a filter begins that does not begin itself."""
    return model.begin(fits[0], t_ns, measurements)
