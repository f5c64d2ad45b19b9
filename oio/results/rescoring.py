"""Re-scoring of a search from its log: every filter variant processes the samples in the order in which they were logged."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from oio.core.interfaces import Sensor
from oio.core.records import Array, GasSample, Innovation, JointState, Truth, WorldSample, seconds
from oio.estimators.odometry import Odometry
from oio.inference.map_fit import CALIBRATED, Fit
from oio.inference.metrics import SourceScore, rms, score_source
from oio.kinematics.arm import Arm
from oio.results.calibration import Navigation
from oio.results.estimate_recorder import EstimateRecorder
from oio.results.evaluation import Outcome, Place
from oio.search.stop_rule import StopRule


@dataclass(slots=True)
class Variant:
    """One filter variant and its scores over the log."""

    odometry: Odometry
    searched: bool  # the filter that ran the search: its maps and its declaration are taken from the record, not recomputed
    last_map: bool = False  # makes the last map only, over the whole trace; no filter runs before it
    nis: list[float] = field(default_factory=list)
    gated: int = 0  # innovations that the gate rejected; they have no part in the mean NIS
    nose_errors_m: list[float] = field(default_factory=list)
    declared_ns: int | None = None
    filtered: tuple[Array, Array] | None = None  # source mean and covariance by the filter alone, before the last map

    def take(self, innovation: Innovation) -> None:
        """Take note of the innovation of a reading that was not missed."""
        if innovation.gated:
            self.gated += 1
        else:
            self.nis.append(innovation.nis)


class Rescoring:
    """Re-runs variants: maps at the times of the search (or the last map only), stop rule evaluated at the end of every move."""

    def __init__(
        self, variants: dict[str, Variant], sensor: Sensor, search: Navigation, stop: StopRule, recorder: EstimateRecorder | None = None
    ) -> None:
        self._recorder = recorder or EstimateRecorder()
        self.variants, self._sensor, self._search, self._stop = variants, sensor, search, stop
        self._pending_ns = sorted({*search.maps_ns, *search.move_ends_ns})
        self._joints: JointState | None = None
        self.truth: Truth | None = None
        self._dead_reckoning_errors_m: list[float] = []

    def run(self, samples: Iterable[WorldSample]) -> None:
        """Process all samples of the search."""
        for sample in samples:
            while self._pending_ns and sample.t_ns > self._pending_ns[0]:
                self._move_ended(self._pending_ns.pop(0))
            self._feed(sample)
        while self._pending_ns:
            self._move_ended(self._pending_ns.pop(0))

    def _feed(self, sample: WorldSample) -> None:
        if isinstance(sample, Truth):
            self.truth = sample
            self._score_nose(sample)
        elif isinstance(sample, JointState):
            self._joints = sample
            for variant in self.variants.values():
                variant.odometry.joints(sample)
            if self.truth is None:
                self._record(sample)
        elif isinstance(sample, GasSample):
            reading = self._sensor.reading(sample)
            for variant in self.variants.values():
                innovation = variant.odometry.reading(reading)
                if innovation is not None and not reading.missed:
                    variant.take(innovation)

    def _move_ended(self, t_ns: int) -> None:
        moves_done = sum(end <= t_ns for end in self._search.move_ends_ns)
        for name, variant in self.variants.items():
            if t_ns in (self._search.maps_ns[-1:] if variant.last_map else self._search.maps_ns):
                variant.filtered = variant.odometry.source()
                hypotheses = self._search.maps[self._search.maps_ns.index(t_ns)]
                variant.odometry.locate(moves_done, hypotheses if variant.searched else ())
                if self._joints is not None:
                    self._recorder.add(self._joints.t_ns, name, variant.odometry, mapped=True)
            if variant.searched:
                variant.declared_ns = self._search.ended_ns if self._search.declared else None
            elif variant.declared_ns is None and self._stop.may_declare(variant.odometry, self._search.made[:moves_done]):
                variant.declared_ns = t_ns

    def _score_nose(self, truth: Truth) -> None:
        """Record nose errors where truth and joints have the same stamp: truth is logged right after the joints of its time."""
        if self._joints is None or self._joints.t_ns != truth.t_ns:
            return
        arm = next(iter(self.variants.values())).odometry.prior.model.arm
        if all(variant.odometry.belief is not None for variant in self.variants.values() if not variant.last_map):
            self._dead_reckoning_errors_m.append(float(np.linalg.norm(arm.nose(self._joints.q) - truth.nose_m)))
        self._record(self._joints)  # at a stamp of the truth, so that it can be scored from the log
        for variant in self.variants.values():
            nose = variant.odometry.nose()
            if nose is not None:
                variant.nose_errors_m.append(float(np.linalg.norm(nose[0] - truth.nose_m)))

    def _record(self, joints: JointState) -> None:
        for name, variant in self.variants.items():
            self._recorder.add(joints.t_ns, name, variant.odometry)

    @property
    def dead_reckoning_m(self) -> float | None:
        """RMS nose error of dead reckoning (encoders alone) [m], over the same instants as the filters."""
        return rms(self._dead_reckoning_errors_m)

    @property
    def source(self) -> Array | None:
        """True source position (3,) [m]; None if the log does not contain it."""
        if self.truth is None or not np.all(np.isfinite(self.truth.source_m)):
            return None
        return self.truth.source_m

    def outcome(self, name: str) -> Outcome:
        """Return the scores of one variant."""
        variant, search, source = self.variants[name], self._search, self.source
        estimate = variant.odometry.source()
        score = score_source(*estimate, source, variant.odometry.prior.model.arm) if estimate and source is not None else _NO_SCORE
        filtered = variant.filtered
        filtered_score = score_source(*filtered, source, variant.odometry.prior.model.arm) if filtered and source is not None else _NO_SCORE
        end_ns = search.ended_ns if variant.declared_ns is None else variant.declared_ns
        final_distance_m = None if self.truth is None or source is None else float(np.linalg.norm(self.truth.nose_m - source))
        return Outcome(
            source_error_m=score.source_error_m,
            bearing_error_deg=score.bearing_error_deg,
            nose_error_m=rms(variant.nose_errors_m),
            nees_source=None if score is _NO_SCORE else score.nees,
            inside_95=None if score is _NO_SCORE else score.inside_95,
            nis_mean=float(np.mean(variant.nis)) if variant.nis else None,
            moves=sum(end <= end_ns for end in search.move_ends_ns),
            time_s=seconds(end_ns - search.began_ns),
            found=variant.declared_ns is not None,
            final_nose_to_source_m=final_distance_m,
            believed_m=None if estimate is None else tuple(float(v) for v in estimate[0]),
            sd_m=None if estimate is None else float(np.sqrt(np.trace(estimate[1]))),
            filtered_error_m=filtered_score.source_error_m,
            world=variant.odometry.hypotheses[0].world if variant.odometry.hypotheses else CALIBRATED,
            filtered_nees=None if filtered_score is _NO_SCORE else filtered_score.nees,
            other_places=tuple(self._place(fit, variant.odometry.prior.model.arm) for fit in variant.odometry.hypotheses[1:]),
        )

    def _place(self, fit: Fit, arm: Arm) -> Place:
        miss = None if self.source is None else score_source(fit.source, fit.source_cov, self.source, arm).nees
        return Place(tuple(float(v) for v in fit.source), float(np.sqrt(np.trace(fit.source_cov))), fit.world, miss)


_NO_SCORE = SourceScore(None, None, 0.0, 3)
