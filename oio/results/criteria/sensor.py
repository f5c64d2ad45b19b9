"""Criteria of the sensor: is it at rest, is its offset known, its noise that of its data sheet, its lag known, do its readings arrive."""

import math

from oio.core.settings import settings
from oio.results.calibration import BaselineResult, MapCalibration, Navigation, WarmUpResult
from oio.results.criteria.judgement import Criterion, Measured, Results


@settings
class WarmUpTrend(Criterion):
    """Slope of the last window of the warm-up in its standard errors; one that the sensor's data sheet calls rest counts as none."""

    def measure(self, results: Results) -> Measured | None:
        """Of the element that drifts most."""
        settled = results.get(WarmUpResult)
        if not isinstance(settled, WarmUpResult):
            return None
        slopes = zip(settled.slope_ppm_per_min, settled.slope_u_ppm_per_min, strict=True)
        trends = [(0.0 if abs(slope) <= settled.rest_ppm_per_min else abs(slope) / max(u, 1e-12), slope, u) for slope, u in slopes]
        value, slope, u = max(trends, key=lambda trend: (trend[0], abs(trend[1])))
        rest = f", at rest below {settled.rest_ppm_per_min:g}" if abs(slope) <= settled.rest_ppm_per_min else ""
        return Measured(
            value, "standard errors", f"drift {slope:+.2f} +- {u:.2f} ppm/min after {settled.waited_s:.0f} s{rest}",
            above="The sensor has not settled: leave it on longer, or raise stage.warm_up.window_s.",
        )  # fmt: skip


@settings
class BaselineReadings(Criterion):
    """Effective independent readings in an element's baseline (GUM 4.2.7): readings within one lag of each other repeat themselves."""

    def measure(self, results: Results) -> Measured | None:
        """Of the element that has fewest."""
        base = results.get(BaselineResult)
        if not isinstance(base, BaselineResult):
            return None
        element = min(base.elements, key=lambda e: e.n_effective)
        found = f"{element.n} clean-air readings count as {element.n_effective:.1f}, offset +- {element.u_ppm:.2g} ppm"
        return Measured(element.n_effective, "1", found, below="Record longer in clean air: raise stage.baseline.samples.")


@settings
class NoiseLevel(Criterion):
    """Variance of an element's clean-air readings over that of the data sheet, at the end of the warm-up. Far above: a bad contact, or air
    that is not clean. Far below: an element that hardly responds, or is stuck."""

    def measure(self, results: Results) -> Measured | None:
        """Of the element that is farthest off."""
        settled = results.get(WarmUpResult)
        if not isinstance(settled, WarmUpResult):
            return None
        ratios = [max(ratio, 1e-6) for ratio in settled.noise_ratios]
        element = max(range(len(ratios)), key=lambda e: abs(math.log(ratios[e])))
        ratio = ratios[element]
        return Measured(
            ratio, "1", f"element {element} has {ratio:.2g} times the data sheet's variance in clean air",
            above="Look for gas in the room, a bad contact, or a cold heater; or correct the sensor's resolution in conf/sensor.",
            below="Its readings hardly move: look whether it is stuck, filtered, or much less sensitive than its data sheet.",
        )  # fmt: skip


@settings
class Lag(Criterion):
    """Expanded uncertainty (k = 2) of the sensor's lag after the bouts: without a step in the gas it stays that of the data sheet."""

    def measure(self, results: Results) -> Measured | None:
        """In percent of the lag."""
        found = results.get(MapCalibration)
        if not isinstance(found, MapCalibration):
            return None
        index = found.fit.layout.tau
        u = float(found.fit.cov[index, index]) ** 0.5
        return Measured(
            200.0 * u, "%", f"lag known to +- {200.0 * u:.0f} % (k = 2)",
            above="No clear step in the gas was seen: use a stronger source, look whether its valve opens, or make more bouts "
            "(stage.calibrate_bouts.moves_per_rung).",
        )  # fmt: skip


@settings
class Clocks(Criterion):
    """Share of the gas readings that never came, by the sensor's own usual interval; a reading at the wrong time is at the wrong place."""

    def measure(self, results: Results) -> Measured | None:
        """Up to the end of the search, or of the calibration."""
        last = results.get(Navigation) or results.get(MapCalibration)
        if not isinstance(last, Navigation | MapCalibration):
            return None
        gaps = last.gaps
        found = f"{gaps.missing} of {gaps.due} gas readings are missing, the longest silence is {gaps.longest_s:.1f} s"
        return Measured(
            100.0 * gaps.missing / max(gaps.due, 1), "%", found, above="Look at the cable, the baud rate and other programs on the port."
        )
