"""Forward model of a trace of readings, with its Jacobian, for the batch fit.

theta = (s (3) m | l | n | k (3) 1/m | u 1/m | o (dof) rad | a (dof) rad/s^2 | ln g (E) | ln tau factor | b (E) ppm)

Reading i of element e at time t:  z_i = g_e f(t_i) + b_e + noise,  f the lagged mean concentration at the nose p(q - o - a t^2 / 2);
the noise is that of `oio.gas.fluctuation`.
"""

import functools
from dataclasses import dataclass, field

import numpy as np

from oio.core.records import Array
from oio.gas import censored
from oio.gas.fluctuation import MeanField, PathField, SecondPlace
from oio.gas.range_law import EXPONENT, LAW, LN_STRENGTH, SOURCE, THINNING, WIND, RangeLaw
from oio.gas.trace import Sniffs
from oio.inference.extension_kernel import LawScale
from oio.inference.forward_kernel import ExpectedPath, Lag
from oio.inference.grid_search import Course, grid_costs, grid_costs_of_pair
from oio.inference.law_extension import UNEXTENDED, LawExtension
from oio.inference.place_predictions import PlacePredictions, predict_places
from oio.kinematics.arm import Arm


@dataclass(frozen=True, slots=True)
class ParameterLayout:
    """Index layout of the parameter vector theta: slice or index of each block."""

    dof: int
    elements: int
    extra: int = 0  # parameters of an extension, at the end

    @property
    def base(self) -> int:
        """Length of theta without an extension."""
        return LAW + 2 * self.dof + 2 * self.elements + 1

    @property
    def size(self) -> int:
        """Length of theta."""
        return self.base + self.extra

    law, source, strength, exponent, wind, thinning = slice(0, LAW), SOURCE, LN_STRENGTH, EXPONENT, WIND, THINNING

    @property
    def offset(self) -> slice:
        """Encoder offsets of the joints at t = 0 [rad]."""
        return slice(LAW, LAW + self.dof)

    @property
    def drift(self) -> slice:
        """Encoder drift of the joints, an acceleration [rad/s^2]."""
        return slice(LAW + self.dof, LAW + 2 * self.dof)

    @property
    def gain(self) -> slice:
        """ln(gain) of the elements."""
        return slice(LAW + 2 * self.dof, LAW + 2 * self.dof + self.elements)

    @property
    def tau(self) -> int:
        """ln(lag / nominal lag)."""
        return LAW + 2 * self.dof + self.elements

    @property
    def baseline(self) -> slice:
        """Offsets of the elements [ppm]."""
        return slice(self.base - self.elements, self.base)


_layout = functools.cache(ParameterLayout)


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """Prediction at a theta: readings without offsets (m,) [ppm], their Jacobian (m, P), or (0, P) if not requested, the lagged
    concentration at the end of the path [ppm], and the mean field along the path."""

    ppm: Array
    rows: Array
    lagged_ppm: float
    along: PathField
    lagged_ppm_at: tuple[float, ...] = ()  # at each place, of a sensor that has two


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """Estimation problem of one trace: readings, arm, range law, nominal lag [s], and the prior of theta (mean, cov)."""

    sniffs: Sniffs
    arm: Arm
    law: RangeLaw
    elements: int
    rise_s: float
    fall_s: float
    mean: Array
    cov: Array
    extension: LawExtension = field(default=UNEXTENDED)

    @property
    def layout(self) -> ParameterLayout:
        """Index layout of theta."""
        return _layout(self.arm.dof, self.elements, self.extension.size)

    def predict(self, theta: Array, want_rows: bool = True) -> Prediction:
        """Evaluate the forward model at theta (P,), with its Jacobian if `want_rows`."""
        places, second = self._places(theta, want_rows), None
        forward = places.forward[0]
        if len(places.forward) > 1:
            other = places.forward[1]
            second = SecondPlace(self._field(theta, other), other.along[5], places.is_second, self.arm.spacing_m)
        field, ppm = self._field(theta, forward), places.ppm
        along = PathField(field, forward.along[4], forward.along[5], self.sniffs.at, places.gain, self.variance(theta, ppm), second)
        return Prediction(ppm, places.rows, float(forward.lagged_ppm), along, places.lagged_ppm_at)

    def _field(self, theta: Array, forward: ExpectedPath) -> MeanField:
        c, rarity, r, speed = forward.along[:4]
        return self.law.field(c, rarity, r, speed, float(theta[self.layout.exponent]), forward.along[6:].T)

    def nose(self, theta: Array) -> Array:
        """Nose positions (k, 3) [m] along the path at theta; of two places of the elements, the middle."""
        return self.arm.board(self._encoders(theta), self.elements)

    def _encoders(self, theta: Array) -> Array:
        """Joints (k, n) [rad] along the path at theta."""
        sn, lay = self.sniffs, self.layout
        offset = theta[lay.offset] + 0.5 * sn.t_s[:, None] ** 2 * theta[lay.drift]
        if self.extension.joints:
            offset = offset + 0.5 * (sn.t_s - sn.t_s[0])[:, None] ** 2 * theta[lay.base + np.array(self.extension.drift)]
        return np.asarray(sn.q - offset)

    def expect(self, theta: Array) -> Array:
        """Predicted readings alone, without offsets (m,) [ppm]."""
        return self._places(theta, False).ppm

    def _places(self, theta: Array, want_rows: bool) -> PlacePredictions:
        lag = Lag(self.rise_s, self.fall_s)
        return predict_places(theta, self.sniffs, self.arm, self.elements, self._scale, lag, self.extension.knots, want_rows)

    @property
    def _scale(self) -> LawScale:
        return LawScale(self.law.r_ref_m, self.law.radius_m)

    def grid_costs(self, thetas: Array, left: Array, z: Array, weight: Array) -> tuple[Array, Array]:
        """Costs of thetas (j, P) that differ in source and strength alone: weighted sums of squares (j,) at the least-squares strength,
        and its ln ratio to that of theta (j,). `left` (m,): decay of the lag's initial state; `z` (m,): readings above it [ppm]."""
        sn, lay, theta = self.sniffs, self.layout, thetas[0]
        gains, factor = np.exp(theta[lay.gain]), float(np.exp(theta[lay.tau]))
        dt, lag = np.diff(sn.t_s, prepend=sn.t_s[0]), Lag(factor * self.rise_s, factor * self.fall_s)
        place = np.array(self.arm.place_of(self.elements))[sn.element]
        if np.all(place == place[0]):
            start, gain = self._initial(theta, 0), gains[sn.element]
            return grid_costs(thetas, self.nose(theta), dt, sn.at, gain, start, self._scale, lag, left, z, weight)
        courses = []
        for i, p in enumerate(self.arm.element_jacobians(self._encoders(theta), self.elements)[0]):
            first = int(np.argmax(place == i))
            begin, after = sn.at[first], dt[sn.at[first] :].copy()
            after[0] = 0.0
            courses.append(Course(p[begin:], after, sn.at[place == i] - begin, gains[sn.element[place == i]], self._initial(theta, first)))
        return grid_costs_of_pair(thetas, courses, place == 1, self._scale, lag, (left, z, weight))

    def _initial(self, theta: Array, i: int) -> float:
        """State of the lag [ppm] that reading i tells."""
        sn, lay, e = self.sniffs, self.layout, self.sniffs.element[i]
        return max(float((sn.ppm[i] - theta[lay.baseline][e]) / np.exp(theta[lay.gain][e])), 0.0)

    def residual(self, theta: Array, h: Array) -> Array:
        """Residuals (m,) [ppm], readings minus prediction; for censored readings see `oio.gas.censored.residual`."""
        sn = self.sniffs
        return censored.residual(self._raw_residual(theta, h), sn.sigma_ppm, sn.censored)

    def variance(self, theta: Array, h: Array) -> Array:
        """White-noise variances of the readings (m,) [ppm^2]; that of a censored reading depends on the prediction."""
        return censored.variance(self._raw_residual(theta, h), self.sniffs.sigma_ppm, self.sniffs.censored)

    def _raw_residual(self, theta: Array, h: Array) -> Array:
        return np.asarray(self.sniffs.ppm - h - theta[self.layout.baseline][self.sniffs.element])
