"""Cold start against calibrated on the same samples, read back from the log, with both assemblies side by side."""

from typing import Annotated, ClassVar

import numpy as np

from oio.core.errors import BadInput
from oio.core.interfaces import Sensor
from oio.core.records import seconds
from oio.core.settings import Within, settings
from oio.estimators.base import Estimator
from oio.estimators.odometry import Odometry
from oio.inference.base import Localizer
from oio.inference.bounds import at_truth, cramer_rao, cramer_rao_over_time, posterior_cramer_rao
from oio.inference.observability import unobservable
from oio.kinematics.arm import Arm
from oio.results.calibration import Calibration, Navigation
from oio.results.estimate_recorder import EstimateRecorder
from oio.results.evaluation import Evaluation, Findings
from oio.results.rescoring import Rescoring, Variant
from oio.results.verdict import ScoreLimits, score
from oio.runtime.context import Context
from oio.search.stop_rule import StopRule

BOUNDS = 50  # over time, of a search
COLD_MAPS, COLD = ("all", "last"), ("cold", "cold_open")


@settings
class Evaluate:
    """Every variant sees the samples in the order in which they were logged and makes its maps when the live search did, or the cold start
    the last of them alone."""

    needs: ClassVar[tuple[type, ...]] = (Calibration, Navigation)
    sensor: Sensor
    arm: Arm
    ekf: Estimator
    belief_map: Localizer
    stop: StopRule  # as navigate's
    limits: ScoreLimits
    narrowed: Annotated[float, Within(0, 1)]  # posterior over prior standard deviation: a direction above it is unobservable
    paper_assembly: bool  # a third of the stage's time
    bound_draws: Annotated[int, Within(1, 100_000)]  # truths from the prior over which van Trees' bound is averaged
    cold_maps: str  # of the cold start: one of COLD_MAPS
    # belief_every_s: between two estimates of a cold start in the log, besides those of its maps
    belief_every_s: Annotated[float, Within(0, 1e6)]

    def check(self) -> None:
        """Refuse unknown maps."""
        if self.cold_maps not in COLD_MAPS:
            given = f"stage.evaluate.cold_maps is '{self.cold_maps}'"
            raise BadInput(f"{given}, but it can be {' or '.join(COLD_MAPS)}. Type stage.evaluate.cold_maps={COLD_MAPS[0]}.")

    def run(self, context: Context) -> Evaluation:
        """Outcomes of all variants, dead reckoning, bounds, and the score against the truth."""
        rerun = self._rerun(context)
        outcomes = {name: rerun.outcome(name) for name in rerun.variants}
        for name, outcome in outcomes.items():
            context.log.progress(context.world.t_ns, name, outcome.in_words())
        bound_m, posterior_bound_m, bounds = self._bounds(rerun, context.rng)
        scored = score(outcomes["calibrated"], bound_m, self.arm.dof, self.limits, self.arm.box_sd_m)
        source = None if rerun.source is None else tuple(float(v) for v in rerun.source)
        return Evaluation(
            outcomes["cold"], outcomes["cold_open"], outcomes["calibrated"], outcomes.get("calibrated_paper_assembly"),
            rerun.dead_reckoning_m, bound_m, posterior_bound_m, self._findings(rerun), scored, source, seconds(context.world.t_ns),
            bounds,
        )  # fmt: skip

    def _findings(self, rerun: Rescoring) -> Findings:
        variant = rerun.variants["calibrated"]
        maps, innovations = variant.odometry.hypotheses, len(variant.nis) + variant.gated
        residuals = maps[0].residuals if maps else None
        return Findings(residuals, self._unseen(rerun), self.arm.dof, self.arm.box_sd_m, innovations, variant.gated)

    def _rerun(self, context: Context) -> Rescoring:
        known, search = context.need(Calibration), context.need(Navigation)
        starts = {"calibrated": known.chosen, "cold": known.cold, "cold_open": known.cold_open}
        if self.paper_assembly:
            starts["calibrated_paper_assembly"] = known.paper
        plain = self.belief_map.as_calibrated  # a search's own maps are on record, and the others show what calibration alone is worth
        variants = {
            name: Variant(Odometry(self.ekf, at, plain), at is known.chosen, name in COLD and self.cold_maps == "last")
            for name, at in starts.items()
        }
        recorder = EstimateRecorder(COLD, self.belief_every_s)
        rerun = Rescoring(variants, self.sensor, search, self.stop, recorder)
        rerun.run(context.log.samples(search.began_ns, search.ended_ns))
        for estimate in sorted(recorder.estimates, key=lambda one: one.variant):  # after the run: the log is being read meanwhile
            context.log.filter_estimate(estimate)
        return rerun

    def _bounds(
        self, rerun: Rescoring, rng: np.random.Generator
    ) -> tuple[float | None, float | None, tuple[tuple[float, float], ...]]:  # fmt: skip
        """Cramer-Rao at the truth, van Trees over the prior [m], and Cramer-Rao over time [s, m]."""
        odometry = rerun.variants["calibrated"].odometry
        if rerun.source is None or not odometry.hypotheses or self.arm.dof < 3:
            return None, None, ()
        sniffs, known = odometry.trace.as_arrays(), odometry.prior
        truth = at_truth(sniffs, known, odometry.hypotheses[0].mean, rerun.source)
        average = posterior_cramer_rao(sniffs, known, rng, self.bound_draws)
        return cramer_rao(sniffs, known, truth).rms_m, average.rms_m, cramer_rao_over_time(sniffs, known, truth, BOUNDS)

    def _unseen(self, rerun: Rescoring) -> tuple[str, ...]:
        odometry = rerun.variants["calibrated"].odometry
        if not odometry.hypotheses:
            return ()
        return unobservable(odometry.trace.as_arrays(), odometry.prior, odometry.hypotheses, self.narrowed)
