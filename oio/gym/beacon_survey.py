"""The readings of one calibration so far, their fit, and how much it knows: what `OIO/Calibrate-v0` observes and rewards."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from oio.core.records import Array, GasReading
from oio.gas.range_law import EXPONENT, LN_STRENGTH, THINNING, WIND
from oio.gas.source import Source
from oio.gas.timing import shift_path
from oio.inference.base import Localizer
from oio.inference.beacon_repeats import BeaconSurvey
from oio.inference.map_fit import Fit
from oio.kinematics.arm import Arm
from oio.results.calibration import BaselineResult

SNIFFS = 6  # the latest measurements that are told


class BeaconStage(Protocol):
    """The stage `map_beliefs`, as far as an environment needs it."""

    arm: Arm
    beacon: Source
    belief_map: Localizer
    budget_s: float

    @property
    def sniff_s(self) -> float:
        """How long the nose dwells at every pose [s]."""
        ...

    def survey(self, base: BaselineResult) -> BeaconSurvey:
        """What is known before the fit."""
        ...


def shapes(dof: int) -> dict[str, tuple[int, ...]]:
    """Shapes of an observation of an arm with `dof` joints."""
    return {"joints": (dof,), "nose": (3,), "law": (5,), "ln_sd": (7,), "sniffs": (SNIFFS, 4), "time": (1,)}


class Survey:
    """Measurements at one beacon; `fit` is None until the first."""

    def __init__(self, stage: BeaconStage, base: BaselineResult) -> None:
        self._stage, self._survey, self.trace = stage, stage.survey(base), stage.belief_map.trace()
        self._offsets_ppm = np.array([element.ppm for element in base.elements])
        self.poses: list[Array] = []
        self._signals_ppm: list[float] = []
        self.fit: Fit | None = None
        self._prior_cov: Array | None = None

    def measured(self, pose: Array, readings: Sequence[GasReading]) -> None:
        """Add a measurement at pose (n,), whose samples are in the trace already, and fit all measurements."""
        self.poses.append(pose)
        signals = [reading.ppm - self._offsets_ppm[reading.element] for reading in readings if not reading.missed]
        self._signals_ppm.append(float(np.mean(signals)) if signals else 0.0)
        if len(self.trace) < 2:
            return
        sensed = self.trace.as_arrays()
        sniffs = shift_path(sensed, self._survey.delay(sensed).s)
        self._prior_cov = self._survey.problem(sniffs).cov
        self.fit = self._survey.fit(sniffs)

    @property
    def known_nats(self) -> float:
        """Half of the reduction of ln det of the covariance of all fitted parameters but the beacon's place; 0 before a fit."""
        if self.fit is None or self._prior_cov is None:
            return 0.0
        rest = slice(LN_STRENGTH, None)
        return 0.5 * float(np.linalg.slogdet(self._prior_cov[rest, rest])[1] - np.linalg.slogdet(self.fit.cov[rest, rest])[1])

    def observe(self, goal: Array, spent_s: float) -> dict[str, Array]:
        """Return the observation after so many seconds of calibration: see `shapes`, each entry within [-1, 1].

        `joints`: of the last goal (n,), over their range. `nose`: there, from the beacon over half of the box's diagonal. `law`: wind,
        exponent and thinning as fitted. `ln_sd`: logarithms of what is left of the standard deviations of strength, exponent, wind,
        thinning and lag, over 8. `sniffs`: nose as above and signal of the latest measurements, the last first. `time`: 1 at the end.
        """
        arm, told = self._stage.arm, {name: np.zeros(shape) for name, shape in shapes(self._stage.arm.dof).items()}
        span = arm.high_rad - arm.low_rad
        told["joints"] = 2.0 * (goal - arm.low_rad) / np.where(span > 0.0, span, 1.0) - 1.0
        told["nose"] = self._place(arm.nose(goal))
        told["time"] = np.array([2.0 * spent_s / max(self._stage.budget_s, 1e-9) - 1.0])
        if self.fit is not None and self._prior_cov is not None:
            wind = self.fit.mean[WIND] / (10.0 + np.linalg.norm(self.fit.mean[WIND]))
            told["law"] = np.array([*wind, self.fit.mean[EXPONENT] / 4.0, self.fit.mean[THINNING] / 20.0])
            at = [LN_STRENGTH, EXPONENT, *range(WIND.start, WIND.stop), THINNING, self.fit.layout.tau]
            left = np.diag(self.fit.cov)[at] / np.maximum(np.diag(self._prior_cov)[at], 1e-18)
            told["ln_sd"] = 0.5 * np.log(np.maximum(left, 1e-18)) / 8.0
        for row, pose, ppm in zip(told["sniffs"], self.poses[::-1], self._signals_ppm[::-1], strict=False):
            row[:3], row[3] = self._place(arm.nose(pose)), np.arcsinh(ppm / self._survey.nominal.sigma_ppm) / 12.0
        return {name: np.clip(np.nan_to_num(value), -1.0, 1.0) for name, value in told.items()}

    def _place(self, p_m: Array) -> Array:
        arm = self._stage.arm
        half_m = 0.5 * float(np.linalg.norm(np.subtract(arm.box_high_m, arm.box_low_m)))
        return np.asarray((p_m - np.array(self._stage.beacon.position)) / half_m)
