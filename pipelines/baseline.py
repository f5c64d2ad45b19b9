"""Five readings of each element in clean air, y_0..y_4: its offset, its noise, and what a bout must exceed."""

from typing import Annotated, ClassVar

import numpy as np

from oio.core.errors import NotSettled
from oio.core.interfaces import Sensor
from oio.core.records import GasReading, GasSample, seconds
from oio.core.settings import Within, settings
from oio.gas.bouts import ElementBaseline, element_baseline
from oio.results.calibration import BaselineResult, WarmUpResult
from oio.runtime.context import Context

PRIOR_READINGS = 10  # the data sheet's noise counts as this many readings when the noise scale is estimated


@settings
class Baseline:
    """The paper's five readings; the noise scale uses the settled window of the warm-up as well."""

    needs: ClassVar[tuple[type, ...]] = (WarmUpResult,)
    sensor: Sensor
    samples: Annotated[int, Within(2, 10_000)]  # per element
    max_s: Annotated[float, Within(0.1, 1e6)]  # then the stage gives up

    def run(self, context: Context) -> BaselineResult:
        """One baseline per element; raises NotSettled if one of them says nothing that can be used."""
        began = context.world.t_ns
        readings: list[list[GasReading]] = [[] for _ in range(self.sensor.elements)]
        while min(len(r) for r in readings) < self.samples:
            for sample in context.world.samples(self.sensor.sample_s):
                if isinstance(sample, GasSample) and len(readings[sample.element]) < self.samples:
                    readings[sample.element].append(self.sensor.reading(sample))
                    context.log.reading(readings[sample.element][-1])
            if seconds(context.world.t_ns - began) > self.max_s:
                raise NotSettled(
                    f"only {' and '.join(str(len(r)) for r in readings)} readings of an element could be used in {self.max_s:g} s of clean "
                    f"air, {self.samples} are needed: the sensor is stuck, stands at its upper rail, or says nothing."
                )
        elements = tuple(self._element(r) for r in readings)
        means = ", ".join(f"{e.ppm:.2f}" for e in elements)
        context.log.progress(context.world.t_ns, "five readings per element", f"{means} ppm")
        return BaselineResult(elements, self._noise_scale(readings, context.need(WarmUpResult)), began)

    def _element(self, readings: list[GasReading]) -> ElementBaseline:
        dt_s = self.sensor.sample_s * self.sensor.elements
        return element_baseline(np.array([r.ppm for r in readings]), dt_s, self.sensor.tau_rise_s, readings[0].sigma_ppm)

    def _noise_scale(self, readings: list[list[GasReading]], settled: WarmUpResult) -> float:
        """Variance of a reading over its nominal one: data sheet, warm-up and baseline, each by its degrees of freedom."""
        sums, dof = float(PRIOR_READINGS), float(PRIOR_READINGS)
        sums += settled.noise_scale * settled.readings
        dof += settled.readings
        for element in readings:
            z = np.array([r.ppm for r in element]) / element[0].sigma_ppm
            sums += float(np.sum((z - z.mean()) ** 2))
            dof += len(z) - 1
        return max(sums / dof, 0.1)
