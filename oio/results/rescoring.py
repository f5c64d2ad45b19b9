"""A search run again over its log: every variant of the filter sees the samples in the order in which they were written."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from oio.core.interfaces import Sensor
from oio.core.records import Array, GasSample, JointState, Truth, WorldSample, seconds
from oio.estimators.odometry import Odometry
from oio.inference.metrics import SourceScore, rms, score_source
from oio.results.calibration import Navigation
from oio.results.summary import Outcome
from oio.search.stop_rule import StopRule


@dataclass(slots=True)
class Variant:
    """One filter, and what the log said of it."""

    odometry: Odometry
    searched: bool  # the filter that made the search: its maps are known
    last_map: bool = False  # makes the last map only, over the whole trace, and no filter runs before
    nis: list[float] = field(default_factory=list)
    nose_errors_m: list[float] = field(default_factory=list)
    declared_ns: int | None = None
    filtered: tuple[Array, Array] | None = None  # the source by the filter alone, before the last map


class Rescoring:
    """Feeds variants; maps are made when the search made them (or the last alone), the stop rule is asked at the end of every move."""

    def __init__(self, variants: dict[str, Variant], sensor: Sensor, search: Navigation, stop: StopRule) -> None:
        self.variants, self._sensor, self._search, self._stop = variants, sensor, search, stop
        self._due = sorted({*search.maps_ns, *search.move_ends_ns})
        self._joints: JointState | None = None
        self.truth: Truth | None = None
        self._dead_m: list[float] = []

    def over(self, samples: Iterable[WorldSample]) -> None:
        """All samples of the search."""
        for sample in samples:
            while self._due and sample.t_ns > self._due[0]:
                self._move_ended(self._due.pop(0))
            self._feed(sample)
        while self._due:
            self._move_ended(self._due.pop(0))

    def _feed(self, sample: WorldSample) -> None:
        if isinstance(sample, Truth):
            self.truth = sample
            self._compare_noses(sample)
        elif isinstance(sample, JointState):
            self._joints = sample
            for variant in self.variants.values():
                variant.odometry.joints(sample)
        elif isinstance(sample, GasSample):
            for variant in self.variants.values():
                innovation = variant.odometry.reading(self._sensor.reading(sample))
                if innovation is not None and not innovation.gated:
                    variant.nis.append(innovation.nis)

    def _move_ended(self, t_ns: int) -> None:
        done = sum(end <= t_ns for end in self._search.move_ends_ns)
        for variant in self.variants.values():
            if t_ns in (self._search.maps_ns[-1:] if variant.last_map else self._search.maps_ns):
                variant.filtered = variant.odometry.source()
                made = self._search.maps[self._search.maps_ns.index(t_ns)]
                variant.odometry.locate(done, made if variant.searched else ())
            if variant.declared_ns is None and self._stop.holds(variant.odometry, self._search.made[:done]):
                variant.declared_ns = t_ns

    def _compare_noses(self, truth: Truth) -> None:
        """At the same instant only: truth is logged right after the joints of its time."""
        if self._joints is None or self._joints.t_ns != truth.t_ns:
            return
        arm = next(iter(self.variants.values())).odometry.prior.model.arm
        if all(variant.odometry.belief is not None for variant in self.variants.values() if not variant.last_map):
            self._dead_m.append(float(np.linalg.norm(arm.nose(self._joints.q) - truth.nose_m)))
        for variant in self.variants.values():
            nose = variant.odometry.nose()
            if nose is not None:
                variant.nose_errors_m.append(float(np.linalg.norm(nose[0] - truth.nose_m)))

    @property
    def dead_reckoning_m(self) -> float | None:
        """RMS error of the nose by encoders alone, over the same instants as the filters'."""
        return rms(self._dead_m)

    @property
    def source(self) -> Array | None:
        """The true source (3,) m; None if the log does not hold it."""
        if self.truth is None or not np.all(np.isfinite(self.truth.source_m)):
            return None
        return self.truth.source_m

    def outcome(self, name: str) -> Outcome:
        """The figures of one variant."""
        variant, search, source = self.variants[name], self._search, self.source
        believed = variant.odometry.source()
        score = score_source(*believed, source, variant.odometry.prior.model.arm) if believed and source is not None else _NO_SCORE
        alone = variant.filtered
        before = score_source(*alone, source, variant.odometry.prior.model.arm) if alone and source is not None else _NO_SCORE
        ended = search.ended_ns if variant.declared_ns is None else variant.declared_ns
        final = None if self.truth is None or source is None else float(np.linalg.norm(self.truth.nose_m - source))
        return Outcome(
            source_error_m=score.source_error_m,
            bearing_error_deg=score.bearing_error_deg,
            nose_error_m=rms(variant.nose_errors_m),
            nees_source=None if score is _NO_SCORE else score.nees,
            inside_95=None if score is _NO_SCORE else score.inside_95,
            nis_mean=float(np.mean(variant.nis)) if variant.nis else None,
            moves=sum(end <= ended for end in search.move_ends_ns),
            time_s=seconds(ended - search.began_ns),
            found=variant.declared_ns is not None,
            final_nose_to_source_m=final,
            believed_m=None if believed is None else tuple(float(v) for v in believed[0]),
            sd_m=None if believed is None else float(np.sqrt(np.trace(believed[1]))),
            filtered_error_m=before.source_error_m,
            filtered_nees=None if before is _NO_SCORE else before.nees,
        )


_NO_SCORE = SourceScore(None, None, 0.0, 3)
