"""Criteria of the sensor: is it at rest, is its offset known, its noise that of its data sheet, its lag known, on rise and fall."""

import math
from typing import Annotated

from oio.core.settings import Within, settings
from oio.inference.rise_and_fall import PRIOR_U
from oio.inference.rise_and_fall import Lag as StepLag
from oio.results.calibration import BaselineResult, MapCalibration, WarmUpResult
from oio.results.criteria.judgement import Criterion, Measured, Results

RECOMMENDED = 30  # effective readings of a baseline
DIFFER = 3.0  # standard uncertainties by which rise and fall may differ before it is said


@settings
class WarmUpTrend(Criterion):
    """Slope of the last window of the warm-up in its standard errors; one that the sensor's data sheet calls rest counts as none."""

    def measure(self, results: Results) -> Measured | None:
        """Of the element that drifts most."""
        settled = results.get(WarmUpResult)
        if not isinstance(settled, WarmUpResult):
            return None
        slopes = zip(settled.slope_ppm_per_min, settled.slope_u_ppm_per_min, strict=True)
        trends = [(_trend(slope, u, settled.rest_ppm_per_min), slope, u) for slope, u in slopes]
        value, slope, u = max(trends, key=lambda trend: (trend[0], abs(trend[1])))
        rest = f", which counts as rest: up to {settled.rest_ppm_per_min:g} ppm/min" if abs(slope) <= settled.rest_ppm_per_min else ""
        return Measured(
            value, "standard errors", f"drift {slope:+.2f} +- {u:.2f} ppm/min after {settled.waited_s:.0f} s{rest}",
            above="The sensor has not settled: leave it on longer, or raise stage.warm_up.window_s.",
        )  # fmt: skip


def _trend(slope: float, u: float, rest: float) -> float:
    """A slope in its standard errors; 0 for rest, infinite for one that cannot be told."""
    if not (math.isfinite(slope) and math.isfinite(u)):
        return math.inf
    return 0.0 if abs(slope) <= rest else abs(slope) / max(u, 1e-12)


@settings
class Drift(Criterion):
    """Slope of the Allan deviation of clean air, by its fitted noise, at the longest tau that the record supports: -0.5 is white noise,
    which averages out, +0.5 a random walk, +1 a straight drift. Only where a record was asked for (stage.warm_up.drift_record_s)."""

    def measure(self, results: Results) -> Measured | None:
        """Of the element whose deviation rises most."""
        settled = results.get(WarmUpResult)
        if not isinstance(settled, WarmUpResult) or settled.drift is None:
            return None
        d = settled.drift
        found = (
            f"the Allan deviation has slope {d.slope:+.2f} at tau = {d.tau_s:.3g} s, the longest that {d.span_s:.0f} s of clean air support"
        )
        drifts = f"Still drifting {60.0 * d.drift_per_s:.2g} ppm/min" if d.drift_per_s else "Its offset walks"
        return Measured(
            d.slope, "1", found, above=f"{drifts}: leave the sensor on longer, keep the room steady, or take baselines more often."
        )


@settings
class BaselineReadings(Criterion):
    """Effective independent readings in an element's baseline (GUM 4.2.7): readings within one lag of each other repeat themselves."""

    def measure(self, results: Results) -> Measured | None:
        """Of the element that has fewest."""
        base = results.get(BaselineResult)
        if not isinstance(base, BaselineResult):
            return None
        element = min(base.elements, key=lambda e: e.n_effective)
        few = f"; {RECOMMENDED} or more are recommended" if element.n_effective < RECOMMENDED else ""
        found = f"{element.n} clean-air readings count as {element.n_effective:.1f}, offset +- {element.u_ppm:.2g} ppm{few}"
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
class Steps(Criterion):
    """Directions, rise and fall, in which the sensor was seen to follow the gas of the beacon: the readings alone, without the data sheet,
    tell the lag of each. The filter has one factor for both; where they differ otherwise than the data sheet says, it is said here."""

    # seen_u: standard uncertainty of ln(lag) by the readings alone, up to which a direction counts as seen
    seen_u: Annotated[float, Within(0.01, PRIOR_U)]

    def measure(self, results: Results) -> Measured | None:
        """None without the stage map_beliefs."""
        found = results.get(MapCalibration)
        if not isinstance(found, MapCalibration):
            return None
        lags = {"rise": found.lags.rise, "fall": found.lags.fall}
        unseen = [name for name, lag in lags.items() if lag.u_ln > self.seen_u]
        said = " and ".join(_lag_in_words(name, lag, name in unseen) for name, lag in lags.items()) + " (k = 2)"
        apart = abs(math.log(found.lags.ratio)) > DIFFER * found.lags.ratio_u_ln and not unseen
        if apart:
            said += (
                f"; fall over rise is {found.lags.ratio:.2g} times the data sheet's, beyond uncertainty: the filter has one factor for both"
            )
        nothing = "No step seen: the source is too weak, or its valve is closed."
        one = f"The {' and '.join(unseen)} was not seen: take the nose from the beacon and back more often (stage.map_beliefs.repeats)."
        return Measured(float(len(lags) - len(unseen)), "directions", said, below=nothing if len(unseen) == len(lags) else one)

    def allowed(self, unit: str) -> str:
        """In words."""
        return "both seen"


def _lag_in_words(name: str, lag: StepLag, unseen: bool) -> str:
    return f"{name} not seen" if unseen else f"{name} {lag.tau_s:.2g} s +- {max(200.0 * lag.u_ln, 1.0):.0f} %"
