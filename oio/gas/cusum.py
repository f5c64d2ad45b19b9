"""CUSUM bout rule (Page 1954): a bout is where the cumulative sum of an element's readings above clean air passes a decision interval."""

import math
from dataclasses import replace
from typing import Annotated

from scipy.optimize import brentq

from oio.core.records import GasReading
from oio.core.settings import Within, settings
from oio.gas.bouts import Bout, BoutDetector, BoutRule, ElementBaseline, refuse_no_windows, window_for

OVERSHOOT = 1.166  # of a discrete sum over its limit, at both ends, in standard deviations (Siegmund 1985)


@settings
class CusumRule:
    """Settings of the CUSUM; the decision interval follows from the false-alarm rate that is asked for."""

    window_by_dof: Annotated[dict[int, int], Within(2, 10_000)]  # k, of the smoothed signal
    # reference_sigmas: taken off every reading: half of the smallest rise that matters, in standard deviations
    reference_sigmas: Annotated[float, Within(0.1, 5)]
    false_alarm_rate: Annotated[float, Within(1e-9, 0.1)]  # per reading, in white noise about a baseline that is known exactly

    def check(self) -> None:
        """Raise BadInput for no windows."""
        refuse_no_windows(self.window_by_dof)

    def window(self, dof: int) -> int:
        """Return the window k for `dof` joints; raises BadInput if none is configured."""
        return window_for(self.window_by_dof, dof)

    def detector(self, k: int, baselines: tuple[ElementBaseline, ...]) -> "CusumDetector":
        """Make it live, for the clean-air baselines of the elements."""
        return CusumDetector(self, k, baselines)

    @property
    def decision_sigmas(self) -> float:
        """Decision interval whose average run length in clean air is 1 / false_alarm_rate, by Siegmund's approximation."""
        return decision_interval(self.reference_sigmas, 1.0 / self.false_alarm_rate)


def run_length(reference: float, decision: float) -> float:
    """Average readings of white noise until the sum passes the decision interval, both in standard deviations.

    (exp(2 d b) - 1 - 2 d b) / (2 d^2) with d = reference and b = decision + 1.166 (Siegmund 1985).
    """
    x = 2.0 * reference * (decision + OVERSHOOT)
    return (math.expm1(x) - x) / (2.0 * reference**2)


def decision_interval(reference: float, readings: float) -> float:
    """Decision interval of an average run length; 0 where already a single reading above the reference is rarer."""
    if run_length(reference, 0.0) >= readings:
        return 0.0
    return float(brentq(lambda decision: run_length(reference, decision) - readings, 0.0, 100.0))


class CusumDetector:
    """CUSUM detector, one reading at a time, with a sum per element: S = max(0, S + (ppm - baseline - u) / sigma - reference).

    u is the standard uncertainty of the baseline, sigma the larger of its spread and the reading's own. A sum that has passed the
    decision interval is a bout, and begins anew.
    """

    def __init__(self, rule: CusumRule, k: int, baselines: tuple[ElementBaseline, ...]) -> None:
        self._reference, self._decision, self._baselines = rule.reference_sigmas, rule.decision_sigmas, baselines
        self._smoothed = BoutDetector(BoutRule(window_by_dof=rule.window_by_dof, differential="smoothed", threshold="max"), k, baselines)
        self._sums = [0.0] * len(baselines)

    def feed(self, reading: GasReading) -> Bout | None:
        """Process one reading; None until the smoothed signal exists, as with the paper's rule."""
        element, baseline = reading.element, self._baselines[reading.element]
        rise = (reading.ppm - baseline.ppm - baseline.u_ppm) / max(baseline.sigma_ppm, reading.sigma_ppm)
        self._sums[element] = max(0.0, self._sums[element] + rise - self._reference)
        step = self._smoothed.feed(reading)
        if step is None:
            return None
        fired = self._sums[element] > self._decision
        if fired:
            self._sums[element] = 0.0
        return replace(step, fired=fired)
