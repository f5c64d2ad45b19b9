"""Criteria of a search: are innovations and residuals those of the model, from both sides, and is the region small enough to be a place."""

from typing import ClassVar

from oio.core.settings import settings
from oio.inference.map_fit import CALIBRATED
from oio.results.criteria.judgement import SEARCH, Criterion, Measured, Results
from oio.results.summary import Evaluation

RECALIBRATE = "Calibrate again in the air, and with the sensor, of the search: leave calibration= and stage= out."


def _evaluation(results: Results) -> Evaluation | None:
    found = results.get(Evaluation)
    return found if isinstance(found, Evaluation) else None


@settings
class MeanNis(Criterion):
    """Mean normalised innovation squared of the calibrated filter, 1 if Q and R are right (Bar-Shalom, Li, Kirubarajan 2001, 5.4)."""

    about: ClassVar[str] = SEARCH

    def measure(self, results: Results) -> Measured | None:
        """None without an innovation."""
        found = _evaluation(results)
        nis = None if found is None else found.calibrated.nis_mean
        return None if nis is None else Measured(
            nis, "1", f"mean NIS is {nis:.2f}, 1 is expected",
            above=RECALIBRATE,
            below="R or the fluctuation is too large, so readings count for too little: use assembly=gum, or calibrate again.",
        )  # fmt: skip


@settings
class Residuals(Criterion):
    """Overdispersion of the last map's whitened residuals: their mean square, times (1 + rho) / (1 - rho) of their autocorrelation rho."""

    about: ClassVar[str] = SEARCH

    def measure(self, results: Results) -> Measured | None:
        """None without a map."""
        found = _evaluation(results)
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
        found = _evaluation(results)
        if found is None or found.findings.residuals is None or found.findings.residuals.halves == 0.0:
            return None
        d2 = found.findings.residuals.halves
        return Measured(
            d2, "1", f"two halves of the search put the source {d2:.1f} apart (squared Mahalanobis distance)",
            above="Something changed, or lies to one side: search again.",
        )  # fmt: skip


@settings
class Localised(Criterion):
    """Standard deviation of the source over that of the whole workspace box: a region as large as the room is no place."""

    about: ClassVar[str] = SEARCH

    def measure(self, results: Results) -> Measured | None:
        """With one or two joints only a bearing is observable, which is judged by `Observable`."""
        found = _evaluation(results)
        if found is None or found.findings.dof < 3:
            return None
        sd_m = found.calibrated.sd_m
        if sd_m is None:
            return Measured(1.0, "of the box", "no map was made: the source is not localisable", above="Raise stage.navigate.max_moves.")
        share = sd_m / found.findings.box_sd_m
        not_localisable = "" if self.warns[1] is None or share <= self.warns[1] else ", which is as good as anywhere: not localisable"
        return Measured(
            share, "of the box", f"the source is known to +- {1e3 * sd_m:.0f} mm, {share:.3f} of the workspace box{not_localisable}",
            above="Sniff longer (stage.navigate.max_moves), nearer, or with a stronger source.",
        )  # fmt: skip


@settings
class Declared(Criterion):
    """Whether the search declared a source by its own stop rule (1) or ran out of moves or time (0)."""

    about: ClassVar[str] = SEARCH

    def measure(self, results: Results) -> Measured | None:
        """With one or two joints nothing can be declared."""
        found = _evaluation(results)
        if found is None or found.findings.dof < 3:
            return None
        outcome = found.calibrated
        said = f"declared after {outcome.moves} moves" if outcome.found else f"the source was not declared within {outcome.moves} moves"
        return Measured(
            float(outcome.found), "1", said, below="The position is unverified: raise stage.navigate.max_moves.",
        )  # fmt: skip

    def allowed(self, unit: str) -> str:
        """In words, as the value is yes or no."""
        return "declared"


@settings
class Places(Criterion):
    """Places that the last map leaves for the source: with more than one the answer is one of them."""

    about: ClassVar[str] = SEARCH

    def measure(self, results: Results) -> Measured | None:
        """None without a map."""
        found = _evaluation(results)
        if found is None or found.calibrated.believed_m is None:
            return None
        places = 1 + len(found.calibrated.other_places)
        return Measured(
            float(places), "1", "one place explains the readings" if places == 1 else f"{places} places explain the readings alike",
            above="Sniff where they differ: raise stage.navigate.max_moves, or use more joints.",
        )  # fmt: skip


@settings
class SameWorld(Criterion):
    """Whether the calibrated world explains the search (0), or another one does better (1): a wall, a wind, a second source."""

    about: ClassVar[str] = SEARCH

    def measure(self, results: Results) -> Measured | None:
        """None without a map."""
        found = _evaluation(results)
        if found is None or found.calibrated.believed_m is None:
            return None
        world = found.calibrated.world
        said = "the calibrated world explains the search" if world == CALIBRATED else f"{world} explains the search better"
        return Measured(float(world != CALIBRATED), "1", said, above=RECALIBRATE)

    def allowed(self, unit: str) -> str:
        """In words, as the value is yes or no."""
        return "the calibrated world"


@settings
class Observable(Criterion):
    """Directions and ambiguities that this motion cannot resolve, by the rank of the Fisher information and the geometry of the path."""

    about: ClassVar[str] = SEARCH

    def measure(self, results: Results) -> Measured | None:
        """Number of them; with one or two joints there is one at least."""
        found = _evaluation(results)
        if found is None:
            return None
        unseen = [*_missing_joints(found.findings.dof), *found.findings.unseen]
        said = "every direction of the source is observable" if not unseen else " ".join(unseen)
        return Measured(
            float(len(unseen)), "1", said.rstrip("."), above="Use more joints (dof), or tell the source's strength (range_law.ln_strength)."
        )

    def allowed(self, unit: str) -> str:
        """In words: any of them costs the PASS."""
        return "all observable"


def _missing_joints(dof: int) -> list[str]:
    if dof >= 3:
        return []
    what = "height and distance" if dof == 1 else "distance (a source and its inverse point give the same readings)"
    return [f"{what} cannot be found with dof={dof}; only the bearing is observable. Add joints: dof=3 or dof=5."]
