"""Criteria of a search: are innovations and residuals as large as the model says, from both sides, and do halves of the readings agree."""

from typing import ClassVar

from oio.core.settings import settings
from oio.results.criteria.judgement import RECALIBRATE, SEARCH, Criterion, Measured, Results
from oio.results.criteria.search import evaluation


@settings
class MeanNis(Criterion):
    """Mean normalised innovation squared of the calibrated filter, 1 if Q and R are right (Bar-Shalom, Li, Kirubarajan 2001, 5.4)."""

    about: ClassVar[str] = SEARCH

    def measure(self, results: Results) -> Measured | None:
        """None without an innovation."""
        found = evaluation(results)
        nis = None if found is None else found.calibrated.nis_mean
        return None if nis is None else Measured(
            nis, "1", f"mean NIS is {nis:.2f}, 1 is expected",
            above=RECALIBRATE,
            below="R or the fluctuation is too large, so readings count for too little: use assembly=gum, or calibrate again.",
        )  # fmt: skip


@settings
class Gated(Criterion):
    """Share of the innovations that the gate of the calibrated filter rejects, five standard deviations and more: next to none if S is
    right, as long as single readings are not disturbed. The mean NIS does not see them."""

    about: ClassVar[str] = SEARCH

    def measure(self, results: Results) -> Measured | None:
        """In percent; None without an innovation."""
        found = evaluation(results)
        if found is None or not found.findings.innovations:
            return None
        n, rejected = found.findings.innovations, found.findings.gated
        percent = 100.0 * rejected / n
        return Measured(
            percent, "%", f"the filter's gate rejects {rejected} of {n} innovations ({percent:.1f} %)",
            above=f"S is too small: R, the fluctuation or the lag is wrong, or single readings are disturbed. {RECALIBRATE}",
        )  # fmt: skip


@settings
class Residuals(Criterion):
    """Overdispersion of the last map's whitened residuals: their mean square, times (1 + rho) / (1 - rho) of their autocorrelation rho."""

    about: ClassVar[str] = SEARCH

    def measure(self, results: Results) -> Measured | None:
        """None without a map."""
        found = evaluation(results)
        if found is None or found.findings.residuals is None:
            return None
        r = found.findings.residuals
        value = r.mean_square if r.mean_square < 1.0 and r.overdispersion <= 1.0 else r.overdispersion
        return Measured(
            value, "1", f"mean square {r.mean_square:.2f}, autocorrelation {r.autocorrelation:.2f}, together {value:.2f}",
            above=RECALIBRATE,
            below="Residuals far smaller than the noise of calibration: it was taken in worse air, or R is too large. Calibrate again.",
        )  # fmt: skip


@settings
class Halves(Criterion):
    """Squared Mahalanobis distance of the sources by two halves of the readings, by time and by place: chi-square, 3 degrees of freedom."""

    about: ClassVar[str] = SEARCH

    def measure(self, results: Results) -> Measured | None:
        """None without a map of everything: only such a one is tested."""
        found = evaluation(results)
        if found is None or found.findings.residuals is None or found.findings.residuals.halves == 0.0:
            return None
        d2 = found.findings.residuals.halves
        return Measured(
            d2, "1", f"two halves of the search put the source {d2:.1f} apart (squared Mahalanobis distance)",
            above="Something changed, or lies to one side: search again.",
        )  # fmt: skip
