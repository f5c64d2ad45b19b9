"""Criteria of the calibration on the beacon: was the known source found again, often enough, and as well as it was promised."""

from oio.core.settings import settings
from oio.results.calibration import MapCalibration
from oio.results.criteria.judgement import Criterion, Measured, Results


@settings
class Repeats(Criterion):
    """Times that the known source was located again: the spread of few is itself unknown."""

    def measure(self, results: Results) -> Measured | None:
        """Of the stage map_beliefs."""
        found = results.get(MapCalibration)
        if not isinstance(found, MapCalibration):
            return None
        n, rms_mm = len(found.repeats), 1e3 * found.type_b.rms_m
        return Measured(
            float(n), "repeats", f"the beacon was located {n} times, {rms_mm:.0f} mm off (RMS)", below="Raise stage.map_beliefs.repeats."
        )


@settings
class CalibrationConsistency(Criterion):
    """Mean NEES per dimension of the located beacon, 1 on average: whether its errors are as large as their covariance says."""

    def measure(self, results: Results) -> Measured | None:
        """Over the repeats; the search inflates its covariance by it where it is above 1."""
        found = results.get(MapCalibration)
        if not isinstance(found, MapCalibration):
            return None
        ratio = sum(repeat.nees for repeat in found.repeats) / (3.0 * len(found.repeats))
        return Measured(
            ratio, "1", f"errors on the beacon have {ratio:.2f} times their expected square",
            above="The range law does not describe this air: keep people and fans away, check beacon.position, calibrate again.",
            below="Errors far smaller than expected: the same readings may have been used twice, or beacon_u_m is too large.",
        )  # fmt: skip
