"""Climb the DoF ladder toward the beacon with the paper's bandit; the spread of the bouts on each rung is its Type A uncertainty."""

from typing import Annotated, ClassVar

import numpy as np

from oio.core.interfaces import Sensor
from oio.core.records import Array, Event, GasReading
from oio.core.settings import Within, settings
from oio.gas.bout_rates import CleanAir, simulated_false_alarms
from oio.gas.bouts import Bout
from oio.gas.detection_rule import DetectionRule, Detector
from oio.gas.source import Source
from oio.gas.trace import Trace
from oio.inference.uncertainty import TypeA, type_a_of_bouts
from oio.kinematics.arm import Arm
from oio.results.calibration import BaselineResult, BoutCalibration
from oio.runtime.context import Context, sniff
from oio.search.bandit import Bandit, Values

_RATES: dict[str, float] = {}  # false alarms by rule, window and elements: the same in every run of a process


@settings
class CalibrateBouts:
    """On rung d only the first d joints move."""

    needs: ClassVar[tuple[type, ...]] = (BaselineResult,)
    sensor: Sensor
    arm: Arm
    bandit: Bandit
    bout: DetectionRule
    beacon: Source
    moves_per_rung: Annotated[int, Within(1, 1000)]
    sniff_s: Annotated[float, Within(0, 600)]  # how long each move's sniff lasts at least; a rung lasts two windows at least
    path_period_s: Annotated[float, Within(0.01, 60)]
    trace_limit: Annotated[int, Within(100, 10_000_000)]

    def run(self, context: Context) -> BoutCalibration:
        """u_a of every rung up to `dof`, and the trace."""
        context.world.present("beacon")
        trace = Trace(self.path_period_s, self.trace_limit)
        rungs = [self._rung(context, dof, trace) for dof in self.arm.rungs if dof <= self.arm.dof]
        return BoutCalibration(tuple(rungs), trace, _false_alarm_rate(self.bout, self.bout.window(self.arm.dof), self.sensor.elements))

    def _rung(self, context: Context, dof: int, trace: Trace) -> TypeA:
        k = self.bout.window(dof)
        detector, values = self.bout.detector(k, context.need(BaselineResult).elements), Values.none(dof)
        steps: list[Bout] = []
        for move in range(self.moves_per_rung):
            q = context.world.goal
            chosen = self.bandit.choose(values, self._allowed(q, dof), context.rng)
            bouts = self._sniff(context, self.bandit.goal(q, chosen), detector, trace, k)
            values = self.bandit.rewarded(values, chosen, float(np.mean([b.fired for b in bouts])) if bouts else 0.0)
            steps += bouts
            fired, signal = sum(b.fired for b in steps), steps[-1].smoothed_ppm if steps else 0.0
            what = f"dof={dof}, move {move + 1} of {self.moves_per_rung}"
            context.log.progress(context.world.t_ns, what, f"{signal:.1f} ppm above baseline, {fired} bouts")
        return type_a_of_bouts(dof, k, steps, self.sensor.sample_s, self.sensor.tau_rise_s, self.moves_per_rung)

    def _allowed(self, q: Array, dof: int) -> np.ndarray:
        """Inside the box, and off the beacon itself."""
        off = np.array([i == 0 or self._off_beacon(q, self.bandit.goal(q, i)) for i in range(2 * dof + 1)])
        return np.asarray(self.bandit.allowed(self.arm, q, dof) & off)

    def _off_beacon(self, here: Array, goal: Array) -> bool:
        place = self.beacon.position
        return place is None or bool(self.arm.clearance_m(here, goal, np.array(place)) > self.beacon.approach_m)

    def _sniff(self, context: Context, goal: Array, detector: Detector, trace: Trace, k: int) -> list[Bout]:
        dwell_s = max(self.sniff_s, 2 * k * self.sensor.sample_s / self.moves_per_rung)
        bouts: list[Bout] = []
        for sensed in sniff(context, self.sensor, goal, dwell_s):
            trace.add(sensed)
            bout = detector.feed(sensed) if isinstance(sensed, GasReading) else None
            if bout is not None:
                bouts.append(bout)
                if bout.fired:
                    context.log.write(Event(bout.t_ns, "bout", f"{bout.smoothed_ppm!r} ppm"))
        return bouts


def _false_alarm_rate(rule: DetectionRule, k: int, elements: int) -> float:
    """Share of clean-air readings, white noise about a baseline of five, that the rule takes for bouts; once per process."""
    key = repr((rule, k, elements))
    if key not in _RATES:
        air, rng = CleanAir(sigma_ppm=1.0, tau_s=0.0, dt_s=1.0, elements=elements), np.random.default_rng(0)
        _RATES[key] = simulated_false_alarms(rule, k, air, rng, steps=100, trials=30).value
    return _RATES[key]
