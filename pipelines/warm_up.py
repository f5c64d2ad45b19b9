"""Wait in clean air until the sensor has settled: no slope, or none that the sensor's own figure of rest would call one."""

from collections import deque
from collections.abc import Iterable
from dataclasses import replace
from typing import Annotated, ClassVar

import numpy as np

from oio.core.errors import BadInput, NotObservable, NotSettled
from oio.core.interfaces import Sensor
from oio.core.records import GasReading, GasSample, seconds
from oio.core.settings import Within, settings
from oio.gas.settling import settling_time
from oio.identification.allan_slope import EndSlope, end_slope
from oio.identification.stationarity import kpss
from oio.results.calibration import WarmUpResult
from oio.runtime.context import Context

ESTIMATES = 100  # of the slope, from which the time left is told
Window = list[deque[GasReading]]


@settings
class WarmUp:
    """A line is fitted to the last readings of each element; warm-up ends when every slope is small, or small against its error."""

    needs: ClassVar[tuple[type, ...]] = ()
    sensor: Sensor
    window_s: Annotated[float, Within(0, 1e5)]  # a line is fitted to the last so many seconds ...
    readings: Annotated[int, Within(4, 10_000)]  # ... and to so many readings of each element at least
    max_s: Annotated[float, Within(0.1, 1e6)]  # then the stage gives up
    rule: str  # slope, or kpss: the readings in the window are stationary at 5 %
    drift_record_s: Annotated[float, Within(0, 1e6)]  # clean air that is recorded afterwards, for `python -m oio.identify`

    def check(self) -> None:
        """Refuse an unknown rule."""
        if self.rule not in ("slope", "kpss"):
            raise BadInput(f"WarmUp.rule is '{self.rule}', but it can be slope or kpss. Type stage.warm_up.rule=slope.")

    def run(self, context: Context) -> WarmUpResult:
        """Returns the slopes at the end; raises NotSettled with the measured slope after max_s."""
        context.world.present("none")
        began, recent = context.world.t_ns, deque[tuple[float, float]](maxlen=ESTIMATES)
        window = [deque[GasReading](maxlen=self._needed) for _ in range(self.sensor.elements)]
        while (waited := seconds(context.world.t_ns - began)) < self.max_s:
            for sample in context.world.samples(self.sensor.sample_s * self.sensor.elements):
                if isinstance(sample, GasSample):
                    reading = self.sensor.reading(sample)
                    context.log.reading(reading)
                    window[reading.element].append(reading)
            if min(len(w) for w in window) == self._needed:
                slopes = [_slope_ppm_per_min(w) for w in window]
                worst = max(slopes, key=lambda pair: abs(pair[0]))
                if not recent or recent[-1][1] != worst[0]:  # a slow sensor has no new slope in every span
                    recent.append((seconds(context.world.t_ns), worst[0]))
                context.log.progress(context.world.t_ns, "slope to vanish", self._in_words(worst, recent))
                if self._at_rest(window, slopes):
                    settled = self._settled(window, slopes, seconds(context.world.t_ns - began))
                    return replace(settled, drift=self._record_drift(context))
        raise NotSettled(self._complaint(waited, window))

    def _in_words(self, worst: tuple[float, float], recent: Iterable[tuple[float, float]]) -> str:
        slope, u = worst
        t_s, slopes = np.array(list(recent)).T
        left_s = settling_time(t_s, slopes, max(self.sensor.settled_ppm_per_min, 2.0 * u))
        return f"{slope:+.2f} +- {u:.2f} ppm/min" + (f", settled in about {left_s:.0f} s" if left_s else "")

    @property
    def _needed(self) -> int:
        """Readings of each element in the window."""
        return max(self.readings, round(self.window_s / (self.sensor.sample_s * self.sensor.elements)))

    def _at_rest(self, window: Window, slopes: list[tuple[float, float]]) -> bool:
        if self.rule == "kpss":
            return all(kpss(np.array([r.ppm for r in w])).stationary for w in window)
        return all(abs(slope) <= max(self.sensor.settled_ppm_per_min, 2.0 * u) for slope, u in slopes)

    def _record_drift(self, context: Context) -> EndSlope | None:
        """Record clean air; returns the steepest slope of an element's Allan deviation, None without a record that has one."""
        if self.drift_record_s == 0.0:
            return None  # not even a span without length goes to the log
        context.log.progress(context.world.t_ns, "drift record", f"{self.drift_record_s:g} s of clean air")
        readings: list[list[GasReading]] = [[] for _ in range(self.sensor.elements)]
        for sample in context.world.samples(self.drift_record_s):
            if isinstance(sample, GasSample):
                reading = self.sensor.reading(sample)
                context.log.reading(reading)
                if not reading.missed:
                    readings[reading.element].append(reading)
        slopes = [slope for element in readings if (slope := _end_slope(element)) is not None]
        return max(slopes, key=lambda slope: slope.slope, default=None)

    def _settled(self, window: Window, slopes: list[tuple[float, float]], waited_s: float) -> WarmUpResult:
        ratio = [_variance_about_line(w) / w[-1].sigma_ppm ** 2 for w in window]
        return WarmUpResult(
            waited_s, tuple(s for s, _ in slopes), tuple(u for _, u in slopes), tuple(map(float, ratio)), self._needed * len(window),
            self.sensor.settled_ppm_per_min, None,
        )  # fmt: skip

    def _complaint(self, waited_s: float, window: Window) -> str:
        if min(len(w) for w in window) < self._needed:
            got = min(len(w) for w in window)
            return f"only {got} readings per element came in {waited_s:.3g} s, {self._needed} are needed; raise stage.warm_up.max_s."
        slope = max((_slope_ppm_per_min(w)[0] for w in window), key=abs)
        return (
            f"sensor '{self.sensor.name}' still drifts by {slope:+.2f} ppm/min after {waited_s:.3g} s; "
            f"{self.sensor.settled_ppm_per_min:g} ppm/min is allowed. Leave it on longer, or raise stage.warm_up.max_s."
        )


def _end_slope(element: list[GasReading]) -> EndSlope | None:
    try:
        return end_slope(np.array([seconds(r.t_ns) for r in element]), np.array([r.ppm for r in element]))
    except NotObservable:  # too short, or readings that never change: the criterion of the noise sees those
        return None


def _line(window: deque[GasReading]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    t = np.array([seconds(r.t_ns) for r in window]) / 60.0
    y = np.array([r.ppm for r in window])
    return t - t.mean(), y, np.polyfit(t - t.mean(), y, 1)


def _variance_about_line(window: deque[GasReading]) -> float:
    t, y, line = _line(window)
    return float(np.sum((y - np.polyval(line, t)) ** 2) / (len(y) - 2))


def _slope_ppm_per_min(window: deque[GasReading]) -> tuple[float, float]:
    t, _, line = _line(window)
    return float(line[0]), float(np.sqrt(_variance_about_line(window) / np.sum(t**2)))
