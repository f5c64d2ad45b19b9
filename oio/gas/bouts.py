"""Bout detection: moving average, the differential of eq. (1), the bout rule of the paper, and the clean-air baselines it refers to.

The paper is ambiguous on the differential (eq. 1 takes y'_t - y'_{t-1}, the sentence before it y_t - y'_{t-1}) and on "greater than the
baseline measurements"; both interpretations are config keys. Offsets and thresholds are per element: one global threshold gives false
bouts.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from oio.core.errors import BadInput
from oio.core.records import Array, GasReading
from oio.core.settings import Within, settings


@dataclass(frozen=True, slots=True, eq=False)
class ElementBaseline:
    """Clean-air baseline of one element, from readings y_0..y_{n-1}: mean, standard deviation, maximum, n and effective sample size."""

    ppm: float
    sigma_ppm: float
    highest_ppm: float
    n: int
    n_effective: float

    @property
    def u_ppm(self) -> float:
        """Standard uncertainty of the mean [ppm], from the effective sample size."""
        return float(self.sigma_ppm / np.sqrt(self.n_effective))


@dataclass(frozen=True, slots=True)
class Bout:
    """One step of the bout rule: y'_t, its differential, and whether it is a bout (the nose approaches the source)."""

    t_ns: int
    smoothed_ppm: float
    delta_ppm: float
    fired: bool
    spread_ppm: float  # standard deviation of the k readings in the window


@settings
class BoutRule:
    """Settings of the bout rule: one key per ambiguity of the paper."""

    window_by_dof: Annotated[dict[int, int], Within(2, 10_000)]  # k
    differential: str  # smoothed: y'_t - y'_{t-1} (eq. 1); raw: y_t - y'_{t-1} (the sentence before it)
    threshold: str  # what y'_t must exceed: max of the baseline readings, or mean_plus_3_sigma

    def check(self) -> None:
        """Raise BadInput for an unknown differential or threshold, or no windows."""
        if self.differential not in ("smoothed", "raw"):
            raise BadInput(f"bout.differential is '{self.differential}', but it can be smoothed or raw. Type bout.differential=smoothed.")
        if self.threshold == "cusum":
            raise BadInput("bout.threshold=cusum was given, but CUSUM is a rule of its own. Type bout=cusum.")
        if self.threshold not in ("max", "mean_plus_3_sigma"):
            raise BadInput(f"bout.threshold is '{self.threshold}', but it can be max or mean_plus_3_sigma. Type bout.threshold=max.")
        refuse_no_windows(self.window_by_dof)

    def window(self, dof: int) -> int:
        """Return the window k for `dof` joints; raises BadInput if none is configured."""
        return window_for(self.window_by_dof, dof)

    def detector(self, k: int, baselines: tuple[ElementBaseline, ...]) -> "BoutDetector":
        """Make it live, for the clean-air baselines of the elements."""
        return BoutDetector(self, k, baselines)

    def threshold_ppm(self, element_baseline: ElementBaseline) -> float:
        """Return the threshold [ppm] for an element's reading above its own baseline mean."""
        return element_baseline.highest_ppm - element_baseline.ppm if self.threshold == "max" else 3.0 * element_baseline.sigma_ppm


def refuse_no_windows(window_by_dof: Mapping[int, int]) -> None:
    """Raise BadInput for an empty mapping, and for a rung that is no number of joints."""
    strange = [dof for dof in window_by_dof if type(dof) is not int or dof < 1]
    if strange:
        raise BadInput(
            f"bout.window_by_dof has the rung '{strange[0]}', but a rung is a number of joints, 1 or more. Type e.g. "
            f"'+bout.window_by_dof={{5: 13}}'."
        )
    if not window_by_dof:
        raise BadInput("bout.window_by_dof is {}, but a window is needed for every rung. Type e.g. '+bout.window_by_dof={5: 13}'.")


def window_for(window_by_dof: Mapping[int, int], dof: int) -> int:
    """Return the window for `dof` joints, 2 dof + 1 where none is given: the rule of the paper's best windows 3, 5, 7 and 11."""
    return window_by_dof.get(dof, 2 * dof + 1)


class BoutDetector:
    """Bout detector, one reading at a time; the signal y is the mean over the elements of their latest readings above baseline."""

    def __init__(self, rule: BoutRule, k: int, baselines: tuple[ElementBaseline, ...]) -> None:
        self._rule, self._k, self._baselines = rule, k, baselines
        self._latest: list[float | None] = [None] * len(baselines)
        self._window: list[float] = []
        self._smoothed: float | None = None  # y'_{t-1}
        self._delta: float | None = None  # delta_{t-1}
        self._threshold = float(np.mean([rule.threshold_ppm(b) for b in baselines]))

    def feed(self, reading: GasReading) -> Bout | None:
        """Process one reading; None until y'_t and y'_{t-1} exist: every element was read, and the window was full at the step before.

        The first differential has no predecessor to exceed, so it never fires.
        """
        self._latest[reading.element] = reading.ppm - self._baselines[reading.element].ppm
        signals = [v for v in self._latest if v is not None]
        if len(signals) < len(self._latest):
            return None
        y = sum(signals) / len(signals)
        self._window = [*self._window[-self._k + 1 :], y]
        if len(self._window) < self._k:
            return None
        previous, smoothed = self._smoothed, float(np.mean(self._window))
        self._smoothed = smoothed
        if previous is None:
            return None
        previous_delta, delta = self._delta, (smoothed if self._rule.differential == "smoothed" else y) - previous  # eq. (1)
        self._delta = delta
        fired = previous_delta is not None and delta > previous_delta and smoothed > self._threshold
        return Bout(reading.t_ns, smoothed, delta, fired, float(np.std(self._window, ddof=1)))


def element_baseline(ppm: Array, dt_s: float, tau_s: float, nominal_sigma_ppm: float) -> ElementBaseline:
    """Estimate the clean-air baseline of one element from readings (n,) [ppm] taken every dt_s through a first-order lag tau_s.

    The standard deviation is at least half the sensor's nominal noise: five readings on one count are chance, not absence of noise.
    """
    sigma = max(float(np.std(ppm, ddof=1)), 0.5 * nominal_sigma_ppm)
    white_share = min(nominal_sigma_ppm**2 / sigma**2, 1.0)  # electronics noise enters after the lag and is white
    n = len(ppm)
    n_effective = 1.0 / (white_share / n + (1.0 - white_share) / effective_samples(n, dt_s, tau_s))
    return ElementBaseline(float(np.mean(ppm)), sigma, float(np.max(ppm)), n, n_effective)


def effective_samples(n: int, dt_s: float, tau_s: float) -> float:
    """Effective sample size of n correlated readings: n / (1 + 2 sum (1 - j/n) rho_j), rho_j = exp(-j dt / tau).

    See GUM 4.2.7; five readings of an electrochemical cell at 0.5 s through a lag of 6 s count as 1.14 independent ones.
    """
    j = np.arange(1, n)
    return float(n / (1.0 + 2.0 * np.sum((1.0 - j / n) * np.exp(-j * dt_s / tau_s))))
