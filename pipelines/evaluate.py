"""Cold start against calibrated on the same samples, read back from the log, with both assemblies side by side."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from oio.arm import Arm
from oio.beliefs import BeliefMap
from oio.bounds import at_truth, cramer_rao
from oio.calibration import Baselines, Calibration, MapCalibration, Navigation
from oio.knowledge import Knowledge
from oio.metrics import SourceScore, rms, score_source
from oio.odometry import Odometry
from oio.pipeline import Context
from oio.protocols import Estimator, Sensor
from oio.records import Array, GasSample, JointState, Truth, seconds
from oio.settings import settings
from oio.summary import Evaluation, Outcome
from oio.verdict import Limits, judge


@dataclass(slots=True)
class _Run:
    """One variant over the log: what it believed at each end of a move, and how far its nose was off."""

    odometry: Odometry
    nis: list[float]
    nose_errors_m: list[float]
    declared_ns: int | None = None


@settings
class Evaluate:
    """Every variant sees the samples in the order in which they were logged and makes its maps when the live search did."""

    needs: ClassVar[tuple[type, ...]] = (Baselines, MapCalibration, Calibration, Navigation)
    sensor: Sensor
    arm: Arm
    estimator: Estimator
    belief_map: BeliefMap
    declare_sd_m: float  # as navigate declares
    limits: Limits

    def run(self, context: Context) -> Evaluation:
        """Outcomes of all variants, dead reckoning, bound and verdict."""
        calibration, search = context.need(Calibration), context.need(Navigation)
        variants = {"calibrated": calibration.chosen, "calibrated_paper_assembly": calibration.paper, "cold": calibration.cold}
        runs = {name: _Run(Odometry(self.estimator, known, self.belief_map), [], []) for name, known in variants.items()}
        dead: list[float] = []
        truth = self._replay(context, search, runs, dead)
        source = None if truth is None or not np.all(np.isfinite(truth.source_m)) else truth.source_m
        outcomes = {name: self._outcome(run, source, truth, search) for name, run in runs.items()}
        bound = self._bound(runs["calibrated"].odometry, calibration.chosen, source)
        verdict = judge(*self._criteria(context, outcomes["calibrated"], bound))
        for name, outcome in outcomes.items():
            context.log.progress(context.world.t_ns, name, outcome.in_words())
        return Evaluation(
            outcomes["cold"], outcomes["calibrated"], outcomes["calibrated_paper_assembly"], rms(dead), bound, verdict,
            None if source is None else tuple(float(v) for v in source), seconds(context.world.t_ns),
        )  # fmt: skip

    def _replay(self, context: Context, search: Navigation, runs: dict[str, _Run], dead: list[float]) -> Truth | None:
        maps, truth, joints = list(search.maps_ns), None, None
        for sample in context.log.samples(search.began_ns, search.ended_ns):
            while maps and sample.t_ns > maps[0]:
                self._map(runs, maps.pop(0), search)
            if isinstance(sample, Truth):
                truth = sample
                self._noses(runs, truth, joints, dead)
            elif isinstance(sample, JointState):
                joints = sample
                for run in runs.values():
                    run.odometry.joints(joints)
                    self._declare(run, joints.t_ns)
            elif isinstance(sample, GasSample):
                for run in runs.values():
                    innovation = run.odometry.reading(self.sensor.reading(sample))
                    if innovation is not None and not innovation.gated:
                        run.nis.append(innovation.nis)
        for t_ns in maps:
            self._map(runs, t_ns, search)
        return truth

    def _map(self, runs: dict[str, _Run], t_ns: int, search: Navigation) -> None:
        for run in runs.values():
            run.odometry.locate(sum(end <= t_ns for end in search.move_ends_ns))
            self._declare(run, t_ns)

    def _noses(self, runs: dict[str, _Run], truth: Truth, joints: JointState | None, dead: list[float]) -> None:
        """Compare at the same instant: truth is logged right after the joints of its time."""
        if joints is None or joints.t_ns != truth.t_ns or runs["calibrated"].odometry.belief is None:
            return
        dead.append(float(np.linalg.norm(self.arm.nose(joints.q) - truth.nose_m)))
        for run in runs.values():
            nose = run.odometry.nose()
            if nose is not None:
                run.nose_errors_m.append(float(np.linalg.norm(nose[0] - truth.nose_m)))

    def _declare(self, run: _Run, t_ns: int) -> None:
        source = run.odometry.source()
        if source is not None and run.declared_ns is None and np.sqrt(np.trace(source[1])) < self.declare_sd_m:
            run.declared_ns = t_ns

    def _outcome(self, run: _Run, source: Array | None, truth: Truth | None, search: Navigation) -> Outcome:
        believed = run.odometry.source()
        score = self._score(believed, source)
        ended = search.ended_ns if run.declared_ns is None else run.declared_ns
        final = None if truth is None or source is None else float(np.linalg.norm(truth.nose_m - source))
        return Outcome(
            source_error_m=None if score is None else score.source_error_m,
            bearing_error_deg=None if score is None else score.bearing_error_deg,
            nose_error_m=rms(run.nose_errors_m),
            nees_source=None if score is None else score.nees,
            inside_95=None if score is None else score.inside_95,
            nis_mean=float(np.mean(run.nis)) if run.nis else None,
            moves=sum(end <= ended for end in search.move_ends_ns),
            time_s=seconds(ended - search.began_ns),
            found=run.declared_ns is not None,
            final_nose_to_source_m=final,
            believed_m=None if believed is None else tuple(float(v) for v in believed[0]),
            sd_m=None if believed is None else float(np.sqrt(np.trace(believed[1]))),
        )

    def _score(self, believed: tuple[Array, Array] | None, source: Array | None) -> SourceScore | None:
        if believed is None or source is None:
            return None
        return score_source(*believed, source, self.arm)

    def _bound(self, odometry: Odometry, known: Knowledge, source: Array | None) -> float | None:
        if source is None or not odometry.hypotheses or self.arm.dof < 3:
            return None
        sniffs = odometry.trace.frozen()
        return cramer_rao(sniffs, known, at_truth(sniffs, known, odometry.hypotheses[0].mean, source))

    def _criteria(self, context: Context, outcome: Outcome, bound: float | None) -> tuple[list[str], list[str]]:
        limits, warnings, failures = self.limits, list[str](), list[str]()
        if outcome.inside_95 is False:
            failures.append(f"the 95 % region misses the source (NEES {outcome.nees_source:.1f}): the covariance is too small.")
        if not outcome.found:
            warnings.append(f"the source was not declared within {outcome.moves} moves: raise stage.navigate.max_moves or go nearer.")
        if outcome.nis_mean is not None and not limits.nis_low <= outcome.nis_mean <= limits.nis_high:
            warnings.append(
                f"mean NIS is {outcome.nis_mean:.2f}, {limits.nis_low:g} to {limits.nis_high:g} is consistent: R or gamma is off."
            )
        worth = min(b.n_effective for b in context.need(Baselines).elements)
        if worth < limits.baseline_effective:
            what = f"the baseline is worth {worth:.1f} independent readings, {limits.baseline_effective:g} are wanted"
            warnings.append(f"{what}: raise stage.baseline.samples.")
        if bound is not None and outcome.source_error_m is not None and outcome.source_error_m > limits.bound_ratio * bound:
            warnings.append(
                f"the source error is {outcome.source_error_m / bound:.1f} times the Cramer-Rao bound, {limits.bound_ratio:g} is usual."
            )
        if self.arm.dof < 3:
            what = "height and distance" if self.arm.dof == 1 else "distance (a source and its inverse point smell alike)"
            warnings.append(f"{what} cannot be found with dof={self.arm.dof}: the bearing is what it can say. Type dof=5 for a position.")
        return warnings, failures
