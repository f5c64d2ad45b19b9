"""`Odometry`: the filter in another program's loop. Joints and readings go in as they come, beliefs of source and nose come out."""

import warnings
from collections import Counter

import numpy as np
from numpy.typing import ArrayLike

from oio.api import array_input
from oio.api.calibration import Calibration, chosen_setup, prior_of
from oio.api.left_out import LeftOut, told_of_glitches
from oio.api.location import Location
from oio.api.samples import check_element, no_measurement
from oio.api.setup import WITHOUT_ARM, Setup
from oio.core.errors import BadInput
from oio.core.records import Array, Belief, GasReading, GasSample, Innovation, JointState
from oio.estimators import odometry
from oio.gas.glitches import glitches
from oio.inference.state_space import StateSpace
from oio.kinematics.finite_differences import FiniteDifferences

GLITCH = "glitch"


class Odometry:
    """Olfactory inertial odometry, fed by hand: `joints` at the rate of the encoders, `reading` as the sensor gives one, and `locate` from
    time to time, when the loop can wait for it (0.1 s to some seconds). Before the first `locate` there is no belief.

    `calibration`: of this sensor in this air; None: data sheets (`setup` is needed then). `box_m` (2, 3) [m]: lower and upper corner of
    where the source may be; None: the arm's workspace box. Without an arm take `setup.without_arm()`, and give a box: the joints are then
    the nose's coordinates (3,) [m]. `assembly` of Q and R: gum or paper. Times are seconds since any beginning, and must not decrease.
    """

    def __init__(
        self, calibration: Calibration | None = None, *, setup: Setup | None = None, box_m: ArrayLike | None = None, assembly: str = "gum"
    ) -> None:
        self.setup = chosen_setup(calibration, setup)
        self._arm = self.setup.robot if box_m is None else self.setup.boxed(box_m)
        prior = prior_of(calibration, self.setup, self._arm, assembly)
        self._filter = odometry.Odometry(self.setup.part("ekf"), prior, self.setup.part("belief_map"))
        self._differences, self._last_ns, self._joints_ns, self._measurements = FiniteDifferences(), 0, -1, 0
        self._calibration = calibration
        if calibration is not None and calibration.delay_s < 0.0:
            raise BadInput(
                f"the calibration says that poses were stamped {-calibration.delay_s:.2f} s late, but joints that are fed as they come "
                f"cannot be moved earlier. Calibrate with stamps of one clock, or use oio.locate."
            )
        if box_m is None and self.setup.arm == WITHOUT_ARM:
            raise BadInput(
                "box_m is needed without an arm: where the source may be, its lower and upper corner (2, 3) in metres, in the frame of the "
                "nose's positions, e.g. box_m=[[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]]."
            )
        self._sigma_ppm = float(self.setup.part("nominal").sigma_ppm)
        self.left_out = Counter[str]()  # number of readings that were not used, by reason

    def joints(self, t_s: float, q: ArrayLike, dq: ArrayLike | None = None, ddq: ArrayLike | None = None) -> None:
        """Feed encoder positions q (n,) rad (m for joints that slide) at t_s [s], and predict to that time.

        Velocity dq (n,) and acceleration ddq (n,) are differences of the positions if they are not given. Raises BadInput for another
        shape, for what is not finite, and for a time that is not later than that of the last joints.
        """
        t_ns = array_input.stamp("joints: t_s", t_s, self._last_ns)
        if t_ns == self._joints_ns:
            raise BadInput(f"joints: t_s is {t_s:.6f} s twice, but joints must come later than the last ones. Leave doubles out.")
        given = array_input.vector("joints: q", q, self._arm.dof)
        if float(np.max(np.abs(given))) > array_input.FARTHEST_M:
            raise BadInput(f"joints: q is {given.tolist()}, but radians are wanted, or metres of what slides. Divide mm by 1000.")
        state = self._differences.state(t_ns, given)
        if dq is not None or ddq is not None:
            told = (array_input.vector(f"joints: {n}", s if v is None else v, self._arm.dof) for n, v, s in
                    (("dq", dq, state.dq), ("ddq", ddq, state.ddq)))  # fmt: skip
            state = JointState(t_ns, state.q, *told)
        self._last_ns = self._joints_ns = t_ns
        self._filter.joints(state)

    def reading(
        self, t_s: float, ppm: float | None = None, *, raw: float | None = None, element: int = 0, sigma_ppm: float | None = None
    ) -> Innovation | None:
        """Feed one reading of an element at t_s [s], in ppm, or raw in the unit of the sensor, and update with it.

        Returns its innovation; None before the first `locate`, and for what is no measurement: a value at or beyond the upper end of the
        sensor's scale, or its sign for none (sensor.no_value); `left_out` counts them. NaN counts as a reading that was missed. Raises
        BadInput for an element that the sensor has not, and for times that decrease.
        """
        if (ppm is None) == (raw is None):
            raise BadInput(f"reading was given {'neither ppm nor raw' if ppm is None else 'both ppm and raw'}, but it takes one of them.")
        nose = self.setup.nose
        check_element(element, nose)
        value = array_input.number("reading: ppm" if raw is None else "reading: raw", ppm if raw is None else raw)
        t_ns = self._last_ns = array_input.stamp("reading: t_s", t_s, self._last_ns)
        why = no_measurement(nose, nose.raw(value) if raw is None else value)
        if why is not None:
            self.left_out[why] += 1
            return None
        if raw is None:
            return self._filter.reading(GasReading(t_ns, element, value, self._sigma_ppm if sigma_ppm is None else float(sigma_ppm)))
        return self._filter.reading(nose.reading(GasSample(t_ns, element, value)))

    def locate(self, measurements: int | None = None, thorough: bool = True) -> Location:
        """Fit all that was fed so far from scratch, and let the filter go on from the best place. Glitches that a sensor with its lag
        cannot have given are taken out of it first, and counted (`left_out`). Raises NotObservable for fewer than two readings.

        `measurements`: places at which the nose stood still, which weigh Type B; None: one more than at the last call. `thorough`: worlds
        that calibration did not see (a wall, another wind) are fitted beside it.
        """
        if self._joints_ns < 0:
            raise BadInput("locate was called before any joints. Feed joints(t_s, q) and reading(t_s, ppm) first.")
        self._take_out_glitches()
        self._measurements = self._measurements + 1 if measurements is None else measurements
        self._filter.locate(self._measurements, thorough=thorough)
        return Location.of(self._filter, self.setup, self._calibration)

    def _take_out_glitches(self) -> None:
        readings = self._filter.trace.readings
        wrong = glitches(readings, self.setup.part("nominal").fall_s)
        if np.any(wrong):
            warnings.warn(told_of_glitches([readings[i] for i in np.flatnonzero(wrong)]), LeftOut, stacklevel=3)
            self.left_out[GLITCH] += int(wrong.sum())
            self._filter.trace.take_out(wrong)

    def source(self) -> tuple[Array, Array] | None:
        """Believed source (3,) m and its covariance (3, 3) m^2 now; None before the first `locate`."""
        found = self._filter.source()
        return None if found is None else (np.array(found[0]), np.array(found[1]))

    def nose(self) -> tuple[Array, Array] | None:
        """Believed nose (3,) m and its covariance (3, 3) m^2 now; None before the first `locate`."""
        return self._filter.nose()

    @property
    def belief(self) -> Belief | None:
        """The whole state: t_ns, mean (N,), cov (N, N); `model.names` are its entries. None before the first `locate`."""
        return self._filter.belief

    @property
    def model(self) -> StateSpace:
        """State-space model in use, with the names and units of the state."""
        return self._filter.model

    @property
    def mean_nis(self) -> float | None:
        """Mean normalised innovation squared of the latest 30 readings, 1 if all is as believed; None for fewer than 10."""
        return self._filter.mean_nis()
