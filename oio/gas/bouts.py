"""Moving average, the differential of eq. (1), the bout rule of the paper, and the baselines it is measured against.

The paper leaves open which differential (eq. 1 takes y'_t - y'_{t-1}, the sentence before it y_t - y'_{t-1}) and what "greater than the
baseline measurements" means; both readings are keys. Offsets and thresholds are per element: one global threshold invents bouts.
"""

from dataclasses import dataclass

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array, GasReading
from oio.core.settings import settings


@dataclass(frozen=True, slots=True, eq=False)
class ElementBaseline:
    """One element in clean air: mean and standard deviation of its readings y_0..y_{n-1}, the largest, and how many they are worth."""

    ppm: float
    sigma_ppm: float
    highest_ppm: float
    n: int
    n_effective: float

    @property
    def u_ppm(self) -> float:
        """Standard uncertainty of the mean, by the effective number of readings."""
        return float(self.sigma_ppm / np.sqrt(self.n_effective))


@dataclass(frozen=True, slots=True)
class Bout:
    """One step of the rule: y'_t, its differential, and whether we approach the source."""

    t_ns: int
    smoothed_ppm: float
    delta_ppm: float
    fired: bool
    spread_ppm: float  # standard deviation of the k readings in the window


@settings
class BoutRule:
    """The rule with both readings of every hole."""

    window_by_dof: dict[int, int]  # k
    differential: str  # smoothed: y'_t - y'_{t-1} (eq. 1); raw: y_t - y'_{t-1} (the sentence before it)
    threshold: str  # what y'_t must exceed: max of the baseline readings, or mean_plus_3_sigma

    def check(self) -> None:
        """Refuse unknown readings of the paper and senseless windows."""
        if self.differential not in ("smoothed", "raw"):
            raise BadInput(f"bout.differential is '{self.differential}', but it can be smoothed or raw. Type bout.differential=smoothed.")
        if self.threshold not in ("max", "mean_plus_3_sigma"):
            raise BadInput(f"bout.threshold is '{self.threshold}', but it can be max or mean_plus_3_sigma. Type bout.threshold=max.")
        if min(self.window_by_dof.values(), default=0) < 2:
            raise BadInput(f"bout.window_by_dof is {self.window_by_dof}, but every window must have at least 2 readings.")

    def window(self, dof: int) -> int:
        """k of a rung; raises BadInput if none is given."""
        if dof not in self.window_by_dof:
            raise BadInput(
                f"bout.window_by_dof has no window for dof={dof}; it has {self.window_by_dof}. Add one, e.g. bout.window_by_dof.{dof}=5."
            )
        return self.window_by_dof[dof]

    def threshold_ppm(self, element_baseline: ElementBaseline) -> float:
        """What an element's reading above its own mean must exceed [ppm]."""
        return element_baseline.highest_ppm - element_baseline.ppm if self.threshold == "max" else 3.0 * element_baseline.sigma_ppm


class BoutDetector:
    """Feeds on readings, one at a time; the signal y is the average of the elements' latest readings above their baselines."""

    def __init__(self, rule: BoutRule, k: int, baselines: tuple[ElementBaseline, ...]) -> None:
        self._rule, self._k, self._baselines = rule, k, baselines
        self._latest: list[float | None] = [None] * len(baselines)
        self._window: list[float] = []
        self._smoothed: float | None = None  # y'_{t-1}
        self._delta: float | None = None  # delta_{t-1}
        self._threshold = float(np.mean([rule.threshold_ppm(b) for b in baselines]))

    def feed(self, reading: GasReading) -> Bout | None:
        """One step; None until there is a y'_t and a y'_{t-1}: every element was read, and the window was full once before.

        The first differential has none before it that it could exceed, so it never fires.
        """
        self._latest[reading.element] = reading.ppm - self._baselines[reading.element].ppm
        known = [v for v in self._latest if v is not None]
        if len(known) < len(self._latest):
            return None
        y = sum(known) / len(known)
        self._window = [*self._window[-self._k + 1 :], y]
        if len(self._window) < self._k:
            return None
        before, smoothed = self._smoothed, float(np.mean(self._window))
        self._smoothed = smoothed
        if before is None:
            return None
        delta_before, delta = self._delta, (smoothed if self._rule.differential == "smoothed" else y) - before  # eq. (1)
        self._delta = delta
        fired = delta_before is not None and delta > delta_before and smoothed > self._threshold
        return Bout(reading.t_ns, smoothed, delta, fired, float(np.std(self._window, ddof=1)))


def element_baseline(ppm: Array, dt_s: float, tau_s: float, nominal_sigma_ppm: float) -> ElementBaseline:
    """Baseline of one element from readings (n,) ppm taken every dt_s through a lag tau_s.

    The standard deviation is not taken below half the sensor's own noise: five readings on one count are luck, not silence.
    """
    sigma = max(float(np.std(ppm, ddof=1)), 0.5 * nominal_sigma_ppm)
    white_share = min(nominal_sigma_ppm**2 / sigma**2, 1.0)  # electronics noise comes after the lag and is white
    n = len(ppm)
    worth = 1.0 / (white_share / n + (1.0 - white_share) / effective_samples(n, dt_s, tau_s))
    return ElementBaseline(float(np.mean(ppm)), sigma, float(np.max(ppm)), n, worth)


def effective_samples(n: int, dt_s: float, tau_s: float) -> float:
    """How many independent readings n correlated ones are worth: n / (1 + 2 sum (1 - j/n) rho_j), rho_j = exp(-j dt / tau).

    GUM 4.2.7 points to it; five readings of an electrochemical cell at 0.5 s through a lag of 6 s are worth 1.14.
    """
    j = np.arange(1, n)
    return float(n / (1.0 + 2.0 * np.sum((1.0 - j / n) * np.exp(-j * dt_s / tau_s))))
