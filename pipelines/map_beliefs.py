"""Fit the range law on the known source, then find that source again and again from five measurements each: the Type B uncertainty."""

from typing import Annotated, ClassVar

import numpy as np

from oio.core.errors import BadInput
from oio.core.interfaces import Sensor
from oio.core.records import Array, seconds
from oio.core.settings import Within, settings
from oio.gas.detection_rule import DetectionRule
from oio.gas.exposures import Exposures, exposures
from oio.gas.range_law import RangeLaw
from oio.gas.signal_range import highest_signals
from oio.gas.source import Source
from oio.gas.timing import shift_path
from oio.gas.trace import Sniffs, Trace
from oio.inference.base import Localizer
from oio.inference.beacon_repeats import BeaconSurvey, Repeat, type_b
from oio.inference.prior import Nominal
from oio.inference.process_noise import ProcessNoise
from oio.inference.rise_and_fall import rise_and_fall
from oio.kinematics.arm import Arm
from oio.results.calibration import BaselineResult, BoutCalibration, MapCalibration
from oio.runtime.context import Context, sniff
from oio.search.measurement_pose import measurement_pose

NEAR = 0.5  # a measurement within this share of the farthest is near the beacon


@settings
class MapBeliefs:
    """Measurements stand around the beacon at given distances, as directions allow; each repeat is judged by a fit of the others."""

    needs: ClassVar[tuple[type, ...]] = (BaselineResult, BoutCalibration)
    sensor: Sensor
    arm: Arm
    range_law: RangeLaw
    process_noise: ProcessNoise
    belief_map: Localizer
    nominal: Nominal
    bout: DetectionRule
    beacon: Source
    beacon_u_m: Annotated[float, Within(1e-6, 1)]  # how well the beacon's place is known, standard uncertainty per axis
    distances_m: Annotated[tuple[float, ...], Within(1e-3, 100)]  # one measurement each; the paper's ideal is five
    repeats: Annotated[int, Within(2, 100)]  # at least; more while calibration, counted from the baseline's beginning, can end within
    budget_s: Annotated[float, Within(0, 1e6)]
    dwell_s: Annotated[float, Within(0, 600)]
    dwell_taus: Annotated[float, Within(0, 10)]  # and so many lags on top

    def check(self) -> None:
        """A vertex needs four spheres."""
        if len(self.distances_m) < 4:
            given = f"stage.map_beliefs.distances_m has {len(self.distances_m)} values"
            raise BadInput(f"{given}, but a vertex needs at least 4. Type e.g. stage.map_beliefs.distances_m=[0.05,0.06,0.08,0.2,0.25].")
        if self.beacon.position is None:
            raise BadInput(
                "beacon.position is null, but calibration needs a source whose place is known. Type beacon.position=[0.33,0.10,0.16]."
            )

    @property
    def sniff_s(self) -> float:
        """How long the nose dwells at every pose [s]."""
        return self.dwell_s + self.dwell_taus * self.sensor.tau_rise_s

    def run(self, context: Context) -> MapCalibration:
        """The fit on all data, the repeats, u_b."""
        trace, ends = context.need(BoutCalibration).trace, [seconds(context.world.t_ns)]
        while len(ends) <= self.repeats * len(self.distances_m) or self._fits(context, ends):
            made = self._measure(context, trace, ends)
            if made < len(self.distances_m):
                break  # no repeat, but what was sensed helps the fit
        return self._result(context, trace.as_arrays(), ends)

    def _result(self, context: Context, sensed: Sniffs, ends: list[float]) -> MapCalibration:
        survey, least = self.survey(context.need(BaselineResult)), len(self.distances_m)
        delay = survey.delay(sensed)
        sniffs = shift_path(sensed, delay.s)
        fit = survey.fit(sniffs)
        repeats = tuple(survey.repeat(sniffs, ends[begin:], least, fit) for begin in range(0, len(ends) - least, least))
        self._draw(context, repeats[-1])
        return MapCalibration(
            fit,
            repeats,
            type_b(repeats),
            context.world.t_ns,
            self._error_ppm(context),
            len(ends) - 1,
            delay,
            context.world.gaps(),
            self.arm.box_sd_m,
            rise_and_fall(survey.problem(sniffs), fit),
            self._exposures(context, sensed, ends),
            highest_signals(sensed, context.need(BaselineResult).elements),
            context.world.guard_account(),
        )

    def _exposures(self, context: Context, sniffs: Sniffs, ends_s: list[float]) -> Exposures:
        """What the bout rule, begun anew, makes of the measurements."""
        detector = self.bout.detector(self.bout.window(self.arm.dof), context.need(BaselineResult).elements)
        near = [distance <= NEAR * max(self.distances_m) for distance in self.distances_m]
        return exposures(detector, sniffs, ends_s, [near[i % len(near)] for i in range(len(ends_s) - 1)])

    def _measure(self, context: Context, trace: Trace, ends_s: list[float]) -> int:
        """Measurements of one more repeat that were made: all, or those that end within the budget if there are repeats enough.

        Their ends are appended to `ends_s`, which begins with the time before the first.
        """
        dwell_s, repeats = self.sniff_s, len(ends_s) // len(self.distances_m)
        for i, distance in enumerate(self.distances_m):
            pose = self._pose(context, distance)
            if repeats >= self.repeats and self._spent_s(context) + context.world.move_s(pose) + dwell_s > self.budget_s:
                return i
            for sensed in sniff(context, self.sensor, pose, dwell_s):
                trace.add(sensed)
            ends_s.append(seconds(context.world.t_ns))
            what = f"repeat {repeats + 1} of {self.repeats} or more, measurement {i + 1} of {len(self.distances_m)}"
            context.log.progress(context.world.t_ns, what, f"{len(trace)} readings")
        return len(self.distances_m)

    def _fits(self, context: Context, ends_s: list[float]) -> bool:
        """Whether a repeat as long as the longest so far would end within the budget."""
        return self._spent_s(context) + float(np.max(np.diff(ends_s[:: len(self.distances_m)]))) <= self.budget_s

    def _spent_s(self, context: Context) -> float:
        return seconds(context.world.t_ns - context.need(BaselineResult).began_ns)

    def _pose(self, context: Context, distance_m: float) -> Array:
        def has_path(goal: Array) -> bool:
            try:
                context.world.move_s(goal)
            except BadInput:
                return False
            return True

        place, here = np.array(self.beacon.position), context.world.goal
        return measurement_pose(self.arm, here, place, distance_m, self.beacon.approach_m, has_path, context.rng)

    def survey(self, base: BaselineResult) -> BeaconSurvey:
        """What is known before the fit."""
        offsets = np.array([b.ppm for b in base.elements]), np.array([b.u_ppm for b in base.elements])
        place = np.array(self.beacon.position), self.beacon_u_m
        return BeaconSurvey(
            self.arm, self.range_law, self.process_noise, self.belief_map, self.nominal, place, offsets, base.noise_scale
        )  # fmt: skip

    def _draw(self, context: Context, repeat: Repeat) -> None:
        text = f"vertex {1e3 * repeat.miss_m:.0f} mm off"
        context.log.spheres(context.world.t_ns, repeat.centres_m, repeat.radii_m, [(repeat.refined_m, repeat.refined_cov_m2)], text)

    def _error_ppm(self, context: Context) -> float:
        """Combined standard uncertainty of a bout's mean signal: Type A of the top rung and the offsets'."""
        base = context.need(BaselineResult).elements
        offsets = sum(b.u_ppm**2 for b in base) / len(base) ** 2
        return float(np.hypot(context.need(BoutCalibration).last.u_a_effective_ppm, np.sqrt(offsets)))
