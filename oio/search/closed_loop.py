"""Closed loop of a search, move by move: a goal goes in, the nose sniffs there, the filter runs, and maps are made when they are due.

Who chooses the goals is left open: the stage `navigate` asks the loop's strategy (`proposed`), and others may choose their own.
"""

import numpy as np

from oio.core.records import Array, JointState, seconds
from oio.estimators.odometry import Odometry
from oio.gas.bouts import ElementBaseline
from oio.gas.detection import WhiffDetector
from oio.gas.range_law import LAW
from oio.inference.map_fit import Fit
from oio.inference.prior import Prior
from oio.runtime.context import Context, sniff
from oio.search.loop_settings import LoopSettings
from oio.search.move_recorder import MoveRecorder
from oio.search.view import Move, View


class ClosedLoop:
    """Live search; it opens the source. The stop rule looks at the belief and the bouts only; nothing here sees the truth."""

    def __init__(self, settings: LoopSettings, context: Context, prior: Prior, baselines: tuple[ElementBaseline, ...]) -> None:
        self._settings, self._context = settings, context
        context.world.present("source")
        self.odometry = Odometry(settings.ekf, prior, settings.belief_map)
        bouts = settings.bout.detector(settings.bout.window(settings.arm.dof), baselines)
        whiffs, believed = WhiffDetector(baselines, prior.model.fall_s), context.world.believed
        self._recorder = MoveRecorder(self.odometry, bouts, whiffs, settings.whiff_sigmas, believed)
        self.began_ns = context.world.t_ns
        self.maps: list[tuple[int, tuple[Fit, ...]]] = []  # when they were made, and what they found
        self.ends_ns: list[int] = []  # of the moves
        self.moves: tuple[Move, ...] = ()
        self.declared = False
        self._mapped = self._thorough_at = 0  # moves at the last map, and at the last thorough one

    @property
    def spent_s(self) -> float:
        """Time since the source was opened [s]."""
        return seconds(self._context.world.t_ns - self.began_ns)

    @property
    def over(self) -> bool:
        """Whether the source is declared, or moves or time are used up."""
        return self.declared or len(self.moves) >= self._settings.max_moves or self.spent_s >= self._settings.max_s

    def view(self) -> View:
        """What a strategy sees: no belief while the plume is lost."""
        return self._view(self._settings.sniff_s)

    def asked(self, view: View) -> Array | None:
        """The goal (n,) rad of a sniff that the loop itself asks for, to tell hypotheses apart or to look elsewhere; None: none."""
        settings, rng = self._settings, self._context.rng
        checks = (settings.verification.propose(view, rng), settings.elsewhere.propose(view, rng))
        return next((check for check in checks if check is not None), None)

    def proposed(self) -> Array:
        """The goal (n,) rad that is asked for, else that of the strategy."""
        view = self.view()
        goal = self.asked(view)
        return self._settings.search.propose(view, self._context.rng) if goal is None else goal

    def move(self, goal: Array) -> None:
        """Sniff at goal (n,) rad, map if it is due, and declare the source if the rule allows. Raises what the guard of the arm refuses.

        A narrow belief is put to the test of a map of everything; only if that agrees the source is declared.
        """
        settings, odometry = self._settings, self.odometry
        self.moves = (*self.moves, self._sniff(goal))
        self.ends_ns.append(self._context.world.t_ns)
        narrow = self._is_narrow()
        if settings.mapping.due(self.moves, self._mapped, self._doubtful()) or narrow:
            due = settings.mapping.thorough(len(self.moves), self._thorough_at)
            thorough = narrow or due or not odometry.consistent(settings.stop.max_nis)
            self._map(thorough)
            self.declared = narrow and settings.stop.may_declare(odometry, self.moves)
        self._tell()

    def finish(self) -> None:
        """Let a map of everything have the last word, unless the last move ended on a map."""
        if self._mapped < len(self.moves) and len(self.odometry.trace) > 1:
            self._map(thorough=True)
            self.declared = self._settings.stop.may_declare(self.odometry, self.moves)
            self._tell()

    def _view(self, dwell_s: float) -> View:
        settings, odometry = self._settings, self.odometry
        believed = (None, ()) if settings.mapping.lost(self.moves) else (odometry.belief, odometry.hypotheses)
        return View(settings.arm, odometry.model, *believed, self.moves, dwell_s, settings.standoff_m, odometry.prior.mean[:LAW])

    def _is_narrow(self) -> bool:
        """Whether a declaration is worth a map of everything: not so soon after the last map, nor before the nose looked elsewhere."""
        settings = self._settings
        too_soon = len(self.moves) < self._mapped + settings.mapping.recheck_moves
        if too_soon or not settings.stop.may_declare(self.odometry, self.moves):
            return False
        return settings.elsewhere.propose(self._view(0.0), self._context.rng) is None

    def _doubtful(self) -> bool:
        return len(self.odometry.hypotheses) > 1 or not self.odometry.consistent(self._settings.stop.max_nis)

    def _map(self, thorough: bool) -> None:
        fits = self.odometry.locate(len(self.moves), thorough=thorough)
        self._log_belief()
        self._mapped = len(self.moves)
        self._thorough_at = self._mapped if thorough else self._thorough_at
        self.maps.append((self._context.world.t_ns, fits))

    def _sniff(self, goal: Array) -> Move:
        recorder = self._recorder
        recorder.begin()
        for sensed in sniff(self._context, self._settings.sensor, goal, self._settings.sniff_s):
            if isinstance(sensed, JointState):
                recorder.joints(sensed)
                continue
            innovation = recorder.reading(sensed)
            if innovation is not None:
                self._context.log.innovation(innovation)
                self._log_belief(self._settings.belief_every_s)
        return recorder.finished(goal)

    def _log_belief(self, every_s: float = 0.0) -> None:
        odometry, log = self.odometry, self._context.log
        belief, nose, model = odometry.belief, odometry.nose(), odometry.model
        if belief is not None and nose is not None:
            log.estimate(belief, model.names, model.units, every_s)
            log.odometry(belief.t_ns, *nose)

    def _tell(self) -> None:
        source, moves, log, t_ns = self.odometry.source(), len(self.moves), self._context.log, self._context.world.t_ns
        if source is None:
            log.progress(t_ns, f"exploring, move {moves} of {self._settings.mapping.explore_moves} or more", "no belief yet")
            return
        hypotheses = [(fit.source, fit.source_cov) for fit in self.odometry.hypotheses[1:]]
        text = f"source +- {1e3 * np.sqrt(np.trace(source[1])):.0f} mm"
        log.spheres(t_ns, np.zeros((0, 3)), np.zeros(0), [source, *hypotheses], text)
        log.progress(t_ns, f"move {moves}, until +- {1e3 * self._settings.stop.sd_m:.0f} mm", text)
