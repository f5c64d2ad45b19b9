"""Criteria of the calibration on the beacon: was the known source found again, often enough, and as well as it was promised."""

from oio.core.settings import settings
from oio.gas.bout_rates import Rate
from oio.results.calibration import BoutCalibration, Calibration, MapCalibration
from oio.results.criteria.judgement import FAIL, Criterion, Measured, Results

TODAY = "Calibrate again as things are now; where only a baseline is missing: stage=[warm_up,baseline,navigate,evaluate]."
OTHER_AIR = "The range law does not describe this air: keep people and fans away, check beacon.position, calibrate again."

RECOMMENDED = 1.0  # percent of readings of noise that a bout rule may take for gas
FAILED = 10.0  # remarks, for which it counts that a calibration failed when it was made


def _calibration(results: Results) -> MapCalibration | None:
    found = results.get(MapCalibration)
    return found if isinstance(found, MapCalibration) else None


@settings
class KeptCalibration(Criterion):
    """Remarks on a calibration that was loaded from a file (calibration=FILE): where it may not fit this run. An answer is no better than
    its calibration: one that failed when it was made fails here."""

    def measure(self, results: Results) -> Measured | None:
        """None if it was made in this run."""
        used = results.get(Calibration)
        if not isinstance(used, Calibration) or used.kept is None:
            return None
        said = " ".join(used.kept.remarks) or "nothing speaks against it"
        count = max(float(len(used.kept.remarks)), FAILED if used.kept.verdict == FAIL else 0.0)
        return Measured(count, "1", f"calibration of {used.kept.file}: {said.rstrip('.')}", above=TODAY)

    def allowed(self, unit: str) -> str:
        """In words: any remark costs the PASS."""
        return "no remark"


@settings
class BoutFalseAlarms(Criterion):
    """Share of readings of white noise that the bout rule takes for gas, simulated: a property of the rule, not of this sensor, of which
    `oio.identify` measures it. Bouts reward the ladder's bandit and count sniffs; no position comes from them."""

    def measure(self, results: Results) -> Measured | None:
        """In percent, of the rule at the top rung."""
        found = results.get(BoutCalibration)
        if not isinstance(found, BoutCalibration):
            return None
        percent = 100.0 * found.false_alarm_rate
        many = f"; {RECOMMENDED:g} % or less is recommended" if percent > RECOMMENDED else ""
        return Measured(
            percent,
            "%",
            f"the bout rule fires on {percent:.1f} % of readings of white noise (simulated){many}",
            above="Type bout=cusum: 0.2 %.",
        )


@settings
class BoutDetection(Criterion):
    """Share of the approaches to the beacon, from the way toward it to the way from it, on which the bout rule fires. Beside it the share
    of single measurements: the paper's rule fires on half of all readings in gas, whether the nose comes or goes."""

    def measure(self, results: Results) -> Measured | None:
        """In percent, of the rule at the top rung; None without an approach."""
        found = results.get(MapCalibration)
        if not isinstance(found, MapCalibration) or not found.exposures.approaches.trials:
            return None
        a, near, away = found.exposures.approaches, found.exposures.near, found.exposures.away
        singly = f"single measurements: {_percent(near)} near it" + (f", {_percent(away)} away" if away.trials else "")
        return Measured(
            100.0 * a.value, "%", f"the bout rule fires on {a.count} of {a.trials} approaches to the beacon ({singly})",
            below="It misses gas: look whether the beacon is open, dwell longer (stage.map_beliefs.dwell_s), or type bout=cusum.",
        )  # fmt: skip


def _percent(rate: Rate) -> str:
    return f"{100.0 * rate.value:.0f} %"


@settings
class Repeats(Criterion):
    """Times that the known source was located again: the spread of few is itself unknown."""

    def measure(self, results: Results) -> Measured | None:
        """Of the stage map_beliefs."""
        found = _calibration(results)
        if found is None:
            return None
        n = len(found.repeats)
        return Measured(float(n), "1", f"the beacon was located {n} times", below="Raise stage.map_beliefs.repeats.")


@settings
class BeaconError(Criterion):
    """RMS error of the located beacon from five measurements each, over the standard deviation of a place anywhere in the workspace box."""

    def measure(self, results: Results) -> Measured | None:
        """Of the stage map_beliefs."""
        found = _calibration(results)
        if found is None:
            return None
        share, rms_mm = found.type_b.rms_m / found.box_sd_m, 1e3 * found.type_b.rms_m
        return Measured(
            share, "of the box", f"the beacon was found {rms_mm:.0f} mm off (RMS), {share:.2f} of the workspace box", above=OTHER_AIR
        )


@settings
class BeaconConsistency(Criterion):
    """Mean NEES per dimension of the located beacon, 1 on average: whether its errors are as large as their covariance says."""

    def measure(self, results: Results) -> Measured | None:
        """Over the repeats; the search inflates its covariance by it where it is above 1."""
        found = _calibration(results)
        if found is None:
            return None
        ratio = sum(repeat.nees for repeat in found.repeats) / (3.0 * len(found.repeats))
        below = "Errors far smaller than expected: the same readings may have been used twice, or beacon_u_m is too large."
        return Measured(ratio, "1", f"errors on the beacon have {ratio:.2f} times their expected square", below, OTHER_AIR)
