"""Criteria of a search: is its gas in the range of the calibration, are innovations and residuals as large as it says, do halves agree."""

from typing import ClassVar

from oio.core.settings import settings
from oio.results.calibration import Calibration, Navigation
from oio.results.criteria.judgement import RECALIBRATE, SEARCH, Criterion, Measured, Results
from oio.results.criteria.search import evaluation
from oio.results.statistics import at_least

NO_GAS = "Nothing tests the calibration so: look whether the source is open, search nearer to it, or longer (stage.navigate.max_moves)."


@settings
class GasRange(Criterion):
    """Signal of the search, below which 95 % of its readings in gas are, over the strongest of the calibration, by element; 0 if no move
    met gas, only noise or what was left in the sensor. A calibration does not hold where it was never looked at."""

    about: ClassVar[str] = SEARCH

    def measure(self, results: Results) -> Measured | None:
        """None without moves, and with a calibration that does not say how strong its gas was."""
        made, search = results.get(Calibration), results.get(Navigation)
        if not isinstance(made, Calibration) or not isinstance(search, Navigation) or made.highest_ppm is None or not search.made:
            return None
        if all(move.whiff_q is None for move in search.made):
            return Measured(0.0, "of the calibration's", "no move of the search met gas, only noise", below=NO_GAS)
        pairs = zip(search.gas_ppm, made.highest_ppm, made.baselines, strict=True)
        ratio, highest = max((met / max(known, base.sigma_ppm), known) for met, known, base in pairs)
        said = f"95 % of the search's gas is below {float(f'{ratio:.2g}'):g} times the calibration's strongest ({highest:.4g} ppm)"
        return Measured(
            ratio, "of the calibration's", said,
            below="The beacon was much stronger: calibrate farther from it (stage.map_beliefs.distances_m), or with a weaker one.",
            above="The sensor was never seen there: calibrate with a stronger beacon, or keep off the source (stage.navigate.standoff_m).",
        )  # fmt: skip


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
    right, as long as single readings are not disturbed. The mean NIS does not see them. The value is what the share is at least with 95 %
    confidence: few innovations say little of it."""

    about: ClassVar[str] = SEARCH

    def measure(self, results: Results) -> Measured | None:
        """In percent; None without an innovation."""
        found = evaluation(results)
        if found is None or not found.findings.innovations:
            return None
        n, rejected = found.findings.innovations, found.findings.gated
        least = 100.0 * at_least(rejected, n)
        known = f"{100.0 * rejected / n:.1f} %; at least {least:.1f} % with 95 % confidence" if rejected else "0.0 %"
        return Measured(
            least, "%", f"the filter's gate rejects {rejected} of {n} innovations ({known})",
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
