"""Find a source at a new, unknown place: explore, map, then sniff where it tells most, until the belief is narrow enough to say so."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from oio.core.errors import WorldEnded
from oio.core.interfaces import Sensor
from oio.core.records import GasReading, JointState, seconds
from oio.core.settings import in_range, settings
from oio.estimators.base import Estimator
from oio.estimators.odometry import Odometry
from oio.gas.bouts import BoutDetector, BoutRule
from oio.gas.detection import WhiffDetector
from oio.gas.range_law import LAW
from oio.inference.belief_map import BeliefMap
from oio.inference.map_fit import Fit
from oio.kinematics.arm import Arm
from oio.results.calibration import Calibration, Navigation
from oio.runtime.context import Context, sniff
from oio.search.base import Strategy
from oio.search.stop_rule import StopRule
from oio.search.view import Move, View


@settings
class Navigate:
    """The closed loop. The stop rule looks at the belief and the bouts only; it never sees the truth."""

    needs: ClassVar[tuple[type, ...]] = (Calibration,)
    sensor: Sensor
    arm: Arm
    estimator: Estimator
    belief_map: BeliefMap
    strategy: Strategy
    rule: BoutRule
    explore: int  # moves before the first belief map, at least;
    smelt: int  # and until so many of them smelt something,
    explore_most: int  # but so many at most
    smelt_sigmas: float  # above what is left of an earlier sniff, in standard deviations of one reading
    lost: int  # after so many silent moves it explores again, until it smells something
    remap: float  # the map is made anew after so many times the moves of the last one,
    recheck: int  # and while it is in doubt, after so many moves
    max_moves: int
    max_s: float
    dwell_s: float
    dwell_taus: float  # and so many lags on top
    near_m: float  # the nose keeps this far from where the source is believed
    stop: StopRule

    def check(self) -> None:
        """Refuse a search that cannot begin or end."""
        in_range(
            self,
            explore=(4, 1000),
            smelt=(0, 1000),
            explore_most=(self.explore, 10_000),
            smelt_sigmas=(0, 1e6),
            lost=(1, 10_000),
            remap=(1.0, 100.0),
            recheck=(1, 10_000),
            max_moves=(self.explore, 10_000),
            max_s=(1.0, 1e6),
            dwell_s=(0, 600),
            dwell_taus=(0, 10),
        )
        in_range(self, near_m=(0, 10))

    def run(self, context: Context) -> Navigation:
        """Searches with the calibrated filter in the chosen assembly; every belief goes to the log."""
        context.world.present("source")
        odometry = Odometry(self.estimator, context.need(Calibration).chosen, self.belief_map)
        began, maps, ends, moves = context.world.t_ns, list[tuple[int, tuple[Fit, ...]]](), list[int](), list[Move]()
        detector = BoutDetector(self.rule, self.rule.window(self.arm.dof), context.need(Calibration).baselines)
        whiff = WhiffDetector(context.need(Calibration).baselines, odometry.known.model.fall_s)
        declared, mapped = False, 0
        while len(moves) < self.max_moves and seconds(context.world.t_ns - began) < self.max_s and not declared:
            try:
                moves.append(self._move(context, odometry, (detector, whiff), tuple(moves)))
            except WorldEnded:
                break  # a log or a recording is over: what is believed by now is the answer
            ends.append(context.world.t_ns)
            # a narrow belief is put to the test of a map of everything; only if that agrees the source is declared
            if self._map_due(odometry, moves, mapped) or self.stop.holds(odometry, tuple(moves)):
                maps.append(self._map(context, odometry, len(moves)))
                mapped = len(moves)
                declared = self.stop.holds(odometry, tuple(moves))
            self._tell(context, odometry, len(moves))
        if mapped < len(moves) and len(odometry.trace) > 1:  # the last word is that of a map of everything
            maps.append(self._map(context, odometry, len(moves)))
            declared = self.stop.holds(odometry, tuple(moves))
            self._tell(context, odometry, len(moves))
        source = odometry.source()
        place = tuple(float(v) for v in source[0]) if source is not None else (np.nan,) * 3
        spread = float(np.sqrt(np.trace(source[1]))) if source is not None else np.inf
        times, fits = tuple(t_ns for t_ns, _ in maps), tuple(fits for _, fits in maps)
        return Navigation(began, context.world.t_ns, times, fits, tuple(ends), tuple(moves), declared, place, spread)

    def _map(self, context: Context, odometry: Odometry, moves: int) -> tuple[int, tuple[Fit, ...]]:
        fits = odometry.locate(moves)
        self._log_belief(context, odometry)
        return context.world.t_ns, fits

    def _move(self, context: Context, odometry: Odometry, told: tuple[BoutDetector, WhiffDetector], moves: tuple[Move, ...]) -> Move:
        dwell_s = self.dwell_s + self.dwell_taus * self.sensor.tau_rise_s
        model, law = odometry.known.model, odometry.known.mean[:LAW]
        believed = (None, ()) if self._lost(moves) else (odometry.belief, odometry.hypotheses)
        goal = self.strategy.propose(View(self.arm, model, *believed, moves, dwell_s, self.near_m, law), context.rng)
        fired, (detector, whiff) = [0], told
        whiff.begin()
        for sensed in sniff(context, self.sensor, goal, dwell_s):
            if isinstance(sensed, JointState):
                odometry.joints(sensed)
                whiff.feed(sensed)
                continue
            self._log(context, odometry, sensed)
            if sensed.missed:
                continue
            bout = detector.feed(sensed)
            if bout is not None:
                fired.append(int(bout.fired))
            whiff.feed(sensed)
        smelt = whiff.q if whiff.fresh > self.smelt_sigmas else None
        return Move(goal, float(np.mean(fired)), whiff.ppm, smelt, whiff.level <= self.smelt_sigmas)

    def _lost(self, moves: Sequence[Move]) -> bool:
        """Whether the latest moves smelt nothing: wherever the source is believed, it is elsewhere."""
        return len(moves) >= self.lost and all(move.silent for move in moves[-self.lost :])

    def _log(self, context: Context, odometry: Odometry, reading: GasReading) -> None:
        innovation = odometry.reading(reading)
        if innovation is not None:
            context.log.innovation(innovation)
            self._log_belief(context, odometry)

    def _log_belief(self, context: Context, odometry: Odometry) -> None:
        belief, nose = odometry.belief, odometry.nose()
        if belief is not None and nose is not None:
            context.log.estimate(belief, odometry.known.model.names, odometry.known.model.units)
            context.log.odometry(belief.t_ns, *nose)

    def _map_due(self, odometry: Odometry, made: list[Move], mapped: int) -> bool:
        """First after exploring; then ever more seldom, but soon while hypotheses compete or the filter is surprised."""
        moves = len(made)
        if mapped == 0:
            return moves >= self.explore and (sum(move.smelt is not None for move in made) >= self.smelt or moves >= self.explore_most)
        if self._lost(made[:-1]) and not self._lost(made):
            return True  # smelt again
        doubtful = len(odometry.hypotheses) > 1 or not odometry.consistent(self.stop.nis)
        return moves >= self.remap * mapped or (doubtful and moves >= mapped + self.recheck)

    def _tell(self, context: Context, odometry: Odometry, moves: int) -> None:
        source = odometry.source()
        if source is None:
            context.log.progress(context.world.t_ns, f"exploring, move {moves} of {self.explore} or more", "no belief yet")
            return
        hypotheses = [(fit.mean[:3], fit.cov[:3, :3]) for fit in odometry.hypotheses[1:]]
        text = f"source +- {1e3 * np.sqrt(np.trace(source[1])):.0f} mm"
        nothing = np.zeros((0, 3)), np.zeros(0)
        context.log.spheres(context.world.t_ns, *nothing, [source, *hypotheses], text)
        context.log.progress(context.world.t_ns, f"move {moves}, until +- {1e3 * self.stop.sd_m:.0f} mm", text)
