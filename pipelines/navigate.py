"""Find a source at a new, unknown place: explore, map, then sniff where it tells most, until the belief is narrow enough to say so."""

from typing import Annotated, ClassVar

import numpy as np

from oio.core.errors import WorldEnded
from oio.core.interfaces import Sensor
from oio.core.records import JointState, seconds
from oio.core.settings import Within, refuse_below, settings
from oio.estimators.base import Estimator
from oio.estimators.odometry import Odometry
from oio.gas.detection import WhiffDetector
from oio.gas.detection_rule import DetectionRule
from oio.gas.range_law import LAW
from oio.gas.signal_range import gas_signals
from oio.inference.base import Localizer
from oio.inference.map_fit import Fit
from oio.kinematics.arm import Arm
from oio.results.calibration import Calibration, Navigation
from oio.runtime.context import Context, sniff
from oio.search.base import Strategy
from oio.search.elsewhere import LookElsewhere
from oio.search.mapping_policy import MappingPolicy
from oio.search.move_recorder import MoveRecorder
from oio.search.stop_rule import StopRule
from oio.search.verification import Verification
from oio.search.view import Move, View


@settings
class Navigate:
    """The closed loop. The stop rule looks at the belief and the bouts only; it never sees the truth."""

    needs: ClassVar[tuple[type, ...]] = (Calibration,)
    sensor: Sensor
    arm: Arm
    ekf: Estimator
    belief_map: Localizer
    search: Strategy
    bout: DetectionRule
    mapping: MappingPolicy
    # whiff_sigmas: a whiff is so far above what is left of an earlier sniff, in standard deviations of one reading
    whiff_sigmas: Annotated[float, Within(0, 1e6)]
    max_moves: Annotated[int, Within(4, 10_000)]
    max_s: Annotated[float, Within(1, 1e6)]
    dwell_s: Annotated[float, Within(0, 600)]
    dwell_taus: Annotated[float, Within(0, 10)]  # and so many lags on top
    standoff_m: Annotated[float, Within(0, 10)]  # the nose keeps this far from where the source is believed
    stop: StopRule
    verification: Verification
    elsewhere: LookElsewhere
    belief_every_s: Annotated[float, Within(0, 1e6)]  # between two beliefs in the log, besides those of maps

    def check(self) -> None:
        """Refuse a search that cannot begin or end."""
        refuse_below(self, "max_moves", "mapping.explore_moves")

    def run(self, context: Context) -> Navigation:
        """Searches with the calibrated filter in the chosen assembly; beliefs go to the log at every map, and at a rate between."""
        context.world.present("source")
        odometry = Odometry(self.ekf, context.need(Calibration).chosen, self.belief_map)
        recorder = self._recorder(context, odometry)
        began, maps, ends, moves = context.world.t_ns, list[tuple[int, tuple[Fit, ...]]](), list[int](), list[Move]()
        declared, mapped, thorough_at = False, 0, 0
        while len(moves) < self.max_moves and seconds(context.world.t_ns - began) < self.max_s and not declared:
            try:
                moves.append(self._move(context, odometry, recorder, tuple(moves)))
            except WorldEnded:
                break  # a log or a recording is over: what is believed by now is the answer
            ends.append(context.world.t_ns)
            # a narrow belief is put to the test of a map of everything; only if that agrees the source is declared
            narrow = self._is_narrow(context, odometry, tuple(moves), mapped)
            if self.mapping.due(moves, mapped, self._doubtful(odometry)) or narrow:
                thorough = narrow or self.mapping.thorough(len(moves), thorough_at) or not odometry.consistent(self.stop.max_nis)
                thorough_at = len(moves) if thorough else thorough_at
                maps.append(self._map(context, odometry, len(moves), thorough))
                mapped = len(moves)
                declared = narrow and self.stop.may_declare(odometry, tuple(moves))
            self._tell(context, odometry, len(moves))
        if mapped < len(moves) and len(odometry.trace) > 1:  # the last word is that of a map of everything
            maps.append(self._map(context, odometry, len(moves), thorough=True))
            declared = self.stop.may_declare(odometry, tuple(moves))
            self._tell(context, odometry, len(moves))
        source = odometry.source()
        place = tuple(float(v) for v in source[0]) if source is not None else (np.nan,) * 3
        spread = float(np.sqrt(np.trace(source[1]))) if source is not None else np.inf
        times, fits = tuple(t_ns for t_ns, _ in maps), tuple(fits for _, fits in maps)
        return Navigation(
            began, context.world.t_ns, times, fits, tuple(ends), tuple(moves), declared, place, spread, context.world.gaps(),
            gas_signals(odometry.trace, context.need(Calibration).baselines), context.world.guard_account(),
        )  # fmt: skip

    def _recorder(self, context: Context, odometry: Odometry) -> MoveRecorder:
        baselines = context.need(Calibration).baselines
        bouts = self.bout.detector(self.bout.window(self.arm.dof), baselines)
        return MoveRecorder(odometry, bouts, WhiffDetector(baselines, odometry.prior.model.fall_s), self.whiff_sigmas)

    def _is_narrow(self, context: Context, odometry: Odometry, moves: tuple[Move, ...], mapped: int) -> bool:
        """Whether a declaration is worth a map of everything: not so soon after the last map, nor before the nose looked elsewhere."""
        if len(moves) < mapped + self.mapping.recheck_moves or not self.stop.may_declare(odometry, moves):
            return False
        return self.elsewhere.propose(self._view(odometry, moves, 0.0), context.rng) is None

    def _doubtful(self, odometry: Odometry) -> bool:
        return len(odometry.hypotheses) > 1 or not odometry.consistent(self.stop.max_nis)

    def _map(self, context: Context, odometry: Odometry, moves: int, thorough: bool) -> tuple[int, tuple[Fit, ...]]:
        fits = odometry.locate(moves, thorough=thorough)
        self._log_belief(context, odometry)
        return context.world.t_ns, fits

    def _move(self, context: Context, odometry: Odometry, recorder: MoveRecorder, moves: tuple[Move, ...]) -> Move:
        dwell_s = self.dwell_s + self.dwell_taus * self.sensor.tau_rise_s
        view = self._view(odometry, moves, dwell_s)
        checks = (self.verification.propose(view, context.rng), self.elsewhere.propose(view, context.rng))
        goal = next((check for check in checks if check is not None), None)
        goal = self.search.propose(view, context.rng) if goal is None else goal
        recorder.begin()
        for sensed in sniff(context, self.sensor, goal, dwell_s):
            if isinstance(sensed, JointState):
                recorder.joints(sensed)
                continue
            innovation = recorder.reading(sensed)
            if innovation is not None:
                context.log.innovation(innovation)
                self._log_belief(context, odometry, self.belief_every_s)
        return recorder.finished(goal)

    def _view(self, odometry: Odometry, moves: tuple[Move, ...], dwell_s: float) -> View:
        """What the strategy sees: no belief while the plume is lost."""
        believed = (None, ()) if self.mapping.lost(moves) else (odometry.belief, odometry.hypotheses)
        return View(self.arm, odometry.model, *believed, moves, dwell_s, self.standoff_m, odometry.prior.mean[:LAW])

    def _log_belief(self, context: Context, odometry: Odometry, every_s: float = 0.0) -> None:
        belief, nose, model = odometry.belief, odometry.nose(), odometry.model
        if belief is not None and nose is not None:
            context.log.estimate(belief, model.names, model.units, every_s)
            context.log.odometry(belief.t_ns, *nose)

    def _tell(self, context: Context, odometry: Odometry, moves: int) -> None:
        source = odometry.source()
        if source is None:
            context.log.progress(context.world.t_ns, f"exploring, move {moves} of {self.mapping.explore_moves} or more", "no belief yet")
            return
        hypotheses = [(fit.source, fit.source_cov) for fit in odometry.hypotheses[1:]]
        text = f"source +- {1e3 * np.sqrt(np.trace(source[1])):.0f} mm"
        nothing = np.zeros((0, 3)), np.zeros(0)
        context.log.spheres(context.world.t_ns, *nothing, [source, *hypotheses], text)
        context.log.progress(context.world.t_ns, f"move {moves}, until +- {1e3 * self.stop.sd_m:.0f} mm", text)
