"""Rates of a bout rule: false alarms per reading in clean air, simulated or counted on real readings, and detections of a step of gas."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from oio.core.records import Array, GasReading, nanoseconds
from oio.gas.bouts import Bout, ElementBaseline, element_baseline
from oio.gas.detection_rule import DetectionRule

COVERAGE = 0.95


@dataclass(frozen=True, slots=True)
class Rate:
    """A share of trials with Wilson's 95 % interval (1927)."""

    count: int
    trials: int

    @property
    def value(self) -> float:
        """The share."""
        return self.count / self.trials

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's interval: within 0 and 1, and none among many is not never."""
        from scipy.stats import binomtest  # here: half a second of import, which a run can do without

        found = binomtest(self.count, self.trials).proportion_ci(COVERAGE, method="wilson")
        return float(found.low), float(found.high)


@dataclass(frozen=True, slots=True)
class CleanAir:
    """Noise of `elements` elements that are read in turn every dt_s: standard deviation sigma_ppm, correlated by a lag tau_s (0: white)."""

    sigma_ppm: float
    tau_s: float
    dt_s: float
    elements: int

    def readings(self, n: int, rng: np.random.Generator) -> Array:
        """Draw readings (n, elements) ppm about zero, each element's own dt_s * elements apart."""
        rho = np.exp(-self.dt_s * self.elements / self.tau_s) if self.tau_s > 0.0 else 0.0
        white = rng.standard_normal((n, self.elements))
        white[1:] *= np.sqrt(1.0 - rho**2)
        if rho > 0.0:
            for i in range(1, n):
                white[i] += rho * white[i - 1]
        return np.asarray(self.sigma_ppm * white)


def simulated_false_alarms(
    rule: DetectionRule, k: int, air: CleanAir, rng: np.random.Generator, baseline: int = 5, steps: int = 200, trials: int = 100
) -> Rate:
    """False alarms per reading in `trials` records of clean air, each with a baseline of its own of so many readings per element."""
    found = [false_alarms(rule, k, air, air.readings(baseline + steps, rng), baseline) for _ in range(trials)]
    return Rate(sum(rate.count for rate in found), sum(rate.trials for rate in found))


def false_alarms(rule: DetectionRule, k: int, air: CleanAir, ppm: Array, baseline: int = 5) -> Rate:
    """False alarms per reading in clean-air readings (n, elements) ppm, the first few of which are the baseline."""
    fired = [bout.fired for bout in _steps(rule, k, air, ppm, baseline)]
    return Rate(sum(fired), max(len(fired), 1))


def detections(
    rule: DetectionRule,
    k: int,
    air: CleanAir,
    height_ppm: float,
    within: int,
    rng: np.random.Generator,
    baseline: int = 5,
    trials: int = 200,
) -> Rate:
    """Steps of height_ppm that are a bout within so many readings after they begin; the lag of the sensor delays them, too."""
    found = 0
    rows = -(-within // air.elements)
    risen = -np.expm1(-np.arange(1, rows + 1) * air.dt_s * air.elements / air.tau_s) if air.tau_s > 0.0 else np.ones(rows)
    for _ in range(trials):
        ppm = air.readings(baseline + 2 * k + rows, rng)
        ppm[-rows:] += height_ppm * risen[:, None]
        steps = list(_steps(rule, k, air, ppm, baseline))
        found += any(bout.fired for bout in steps[-rows * air.elements :])
    return Rate(found, trials)


def _steps(rule: DetectionRule, k: int, air: CleanAir, ppm: Array, baseline: int) -> Iterator[Bout]:
    """Steps of the rule over the readings (n, elements) after the baseline; rows are read element by element."""
    detector = rule.detector(k, _baselines(air, ppm[:baseline]))
    for i, row in enumerate(ppm[baseline:].tolist()):
        for element, value in enumerate(row):
            t_ns = nanoseconds((i * air.elements + element) * air.dt_s)
            bout = detector.feed(GasReading(t_ns, element, value, air.sigma_ppm))
            if bout is not None:
                yield bout


def _baselines(air: CleanAir, ppm: Array) -> tuple[ElementBaseline, ...]:
    return tuple(element_baseline(column, air.dt_s * air.elements, max(air.tau_s, 1e-9), air.sigma_ppm) for column in ppm.T)
